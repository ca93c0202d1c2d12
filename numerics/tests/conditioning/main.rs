//! Ill-conditioned problems: the answer is right, flagged or refused, never finite and wrong in silence.
//!
//! Through the public API of the numerics alone. Clouds and random numbers are seeded; every tolerance says where it comes
//! from.

#[path = "../common/mod.rs"]
mod common;

mod cliff;
mod hard;
mod noise;
mod placement;
mod remedy;
mod small;
mod smooth;
mod support;
mod twins;
