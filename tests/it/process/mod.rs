//! Tests of the process: its settings, keys, sockets, files, logs and metrics.

mod access;
pub mod connections;
mod ending;
mod files;
mod keys;
mod log;
mod memory;
pub mod metrics;
mod pages;
mod settings;
mod spans;
mod tls;
