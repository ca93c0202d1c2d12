//! What surrounds every request: its name and log line, its framing, its key, its deadline.

pub mod authentication;
pub mod middleware;
pub mod span;
pub mod trace;
pub mod transport;
