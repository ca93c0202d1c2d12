//! The process: what its build has, what the machine gives it, what tells it to end, and its log.

pub mod counters;
pub mod features;
pub mod machine;
pub mod signals;
pub mod telemetry;
