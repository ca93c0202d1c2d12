//! What all requests share, whatever they compute. This module knows no request.

pub mod host;
pub mod jobs;
pub mod kept;
pub mod metrics;
pub mod settings;
