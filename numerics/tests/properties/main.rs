//! Properties of the numerics that hold for every kernel, tested through the public API.
//!
//! A kernel is left out of a property only where mathematics excludes it, and the test says why.
//! Clouds and random numbers are seeded. Tolerances are bounds from rounding (n ε cond) or from
//! the order of convergence.

#[path = "../common/mod.rs"]
mod common;

mod axes;
mod choices;
mod fit;
mod invariance;
mod operators;
mod support;
