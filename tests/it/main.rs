//! Tests of the service over real sockets.

// The lint keeps locks and waits off the threads of pools. The threads of tests belong to no pool.
#![allow(clippy::disallowed_methods)]

#[path = "../../numerics/tests/common/mod.rs"]
mod common;

mod all_routes;
mod document;
mod load;
mod process;
mod routes;
mod running;
mod store;
mod support;
mod wire;
