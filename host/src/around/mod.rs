//! Layers around every request: request id and log line, framing, key, deadline.

pub mod authentication;
pub mod middleware;
pub mod span;
pub mod trace;
pub mod transport;
