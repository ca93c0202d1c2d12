//! What all requests share. Nothing in here knows a request.

pub mod app;
pub mod durable;
pub mod jobs;
pub mod kept;
