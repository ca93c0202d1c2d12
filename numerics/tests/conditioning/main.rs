//! Ill-conditioned problems: the answer is right, flagged or refused, but never silently wrong.
//!
//! Tests use only the public API of the numerics. Clouds and random numbers are seeded. Every
//! tolerance states its origin.

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
