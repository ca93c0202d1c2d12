//! The numerical heart: f64 in, f64 out.
//!
//! Pure by rule: no JSON, HTTP, async, environment, clock or global state. Heavy loops run on the rayon pool of the calling
//! thread; stages and cancellation pass through an [`observer::Observer`].

pub mod cloud;
pub mod defaults;
pub mod degeneracy;
pub mod duplicates;
pub mod error;
pub mod geometry;
pub mod gram;
pub mod instruction_set;
pub mod interpolant;
pub mod jets;
pub mod kernel;
pub mod memory;
pub mod neighbours;
pub mod nodes;
pub mod noise;
pub mod observer;
pub mod operators;
pub mod posterior;
pub mod regularization;
pub mod solver;
pub mod surface;

mod eigen;
mod examination;
mod exp;
pub(crate) mod heap;
mod offset;
mod orientation;
mod patch;
mod rescue;
mod resolution;
mod shape;
mod simd;
#[cfg(test)]
mod testing;
mod vector;
