//! Functions from values at the points: kernel regression, interpolation where α is 0.
//!
//! The rooms, each of which knows those before it: [`sums`], [`solver`], [`selection`], [`function`].

pub mod sums;

pub mod solver;

pub mod selection;

pub mod function;
