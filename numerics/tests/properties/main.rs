//! Properties of the numerics that hold for every kernel, through the public API alone.
//!
//! A kernel is left out of a property only where mathematics leaves it out, and the test says why. Clouds and
//! random numbers are seeded, tolerances are bounds from rounding (n ε cond) or from the order of
//! convergence.

#[path = "../common/mod.rs"]
mod common;

mod axes;
mod choices;
mod fit;
mod invariance;
mod operators;
mod support;
