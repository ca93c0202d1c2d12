//! Geometric kernel interpolation and regression on point clouds, after Guidotti, served over HTTP.
//!
//! Layers, arrows pointing down: [`server`] → [`http`] → [`store`] → [`numerics`]. `numerics` is pure: f64 in, f64 out. Only
//! `http` knows status codes and JSON. ARCHITECTURE.md has the map.

pub mod numerics;
pub mod store;

pub mod http;

pub mod app;
pub mod config;
pub mod server;
pub mod telemetry;
