//! Serves computations that take minutes, in bounded memory, over HTTP.
//!
//! The crate is independent of any subject. A service over it defines requests, their prices and their
//! computation (`operation`). The host provides everything else: bodies within limits, memory reserved before
//! it is used, threads by size of work and in turns among owners, jobs that outlive their connection, problem
//! documents, keys, sockets.

// A request must never bring a thread down. Tests may.
#![cfg_attr(test, allow(clippy::disallowed_methods))]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable))]

pub mod access;
pub mod around;
pub mod compute;
pub mod jobs;
pub mod memory;
pub mod operation;
pub mod problem;
pub mod process;
pub mod server;
pub mod state;
pub mod store;
#[cfg(test)]
mod testing;
pub mod wire;
