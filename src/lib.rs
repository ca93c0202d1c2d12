//! Geometric kernel interpolation and regression on point clouds, after Guidotti, served over HTTP.
//!
//! The mathematics is `gramian_numerics`: f64 in, f64 out. What serves any computation of minutes over HTTP
//! is `gramian_host`. This crate is what requests about clouds ask, and what they are answered.
//! ARCHITECTURE.md has the map.

// A request must never bring a thread down. Tests may.
#![cfg_attr(test, allow(clippy::disallowed_methods))]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable))]

pub mod store;

pub mod http;

pub mod arguments;
pub mod config;
pub mod files;
mod memory;
