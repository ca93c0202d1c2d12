//! State that all requests share. This module knows no request.

pub mod app;
pub mod durable;
