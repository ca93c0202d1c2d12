//! Geometric kernel interpolation and regression on point clouds, after Guidotti, served over HTTP.
//!
//! Layers, arrows pointing down: [`server`] → [`http`] → [`store`] → [`gramian_numerics`]. The last is a
//! crate of its own and pure: f64 in, f64 out. Only `http` knows status codes and JSON. ARCHITECTURE.md has
//! the map.

// A request must never bring a thread down. Tests may.
#![cfg_attr(test, allow(clippy::disallowed_methods))]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable))]

pub mod store;

pub mod http;

pub mod config;
pub mod features;
pub mod files;
mod machine;
mod memory;
mod process;
pub mod server;
pub mod signals;
pub mod telemetry;
