//! Shared state of all requests, independent of what they compute.

pub mod host;
pub mod jobs;
pub mod kept;
pub mod metrics;
pub mod settings;
