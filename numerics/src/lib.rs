//! The numerical heart: f64 in, f64 out.
//!
//! Pure by rule: no JSON, HTTP, async, environment, clock or global state. Heavy loops run on the rayon pool of the calling
//! thread; stages and cancellation pass through an [`observer::Observer`].
//!
//! The rooms, each of which knows those before it: `machine`, `points`, `kernel`, `patches`, `sums`, `solver`, `selection`, `function`, `surface`, `model`.

// A request must never bring a thread down; tests may.
#![cfg_attr(test, allow(clippy::disallowed_methods))]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable))]

// The clouds of all tests name this crate as they do.
#[cfg(test)]
extern crate self as gramian_numerics;

pub mod error;
pub mod observer;

pub mod machine;
pub mod points;

pub mod kernel;

pub mod patches;

pub mod sums;

pub mod solver;

pub mod selection;

pub mod function;

pub mod surface;

pub mod model;

#[cfg(test)]
pub(crate) mod testing;
