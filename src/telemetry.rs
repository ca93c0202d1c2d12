//! Logs: one JSON line each, to standard error.

use tracing_subscriber::EnvFilter;

/// Starts logging at the level of `RUST_LOG`, `info` if absent.
pub fn start() {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("info"));
    tracing_subscriber::fmt().json().with_env_filter(filter).with_writer(std::io::stderr).init();
}
