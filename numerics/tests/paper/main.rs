//! The paper's experiments, one file each, with the paper's figures beside ours.
//!
//! `examples/paper_tables.rs` prints the tables. The paper is Patrick Guidotti, "Geometric Kernel
//! Interpolation and Regression", section "Numerical Experiments", with the corrected formulas of
//! docs/errata.md. Seeds are fixed. What the paper draws at random once is drawn 20 times here.

#[path = "../common/mod.rs"]
mod common;

pub mod ellipsoid;
pub mod half_ellipse;
pub mod inflections;
pub mod noisy_ellipse;
pub mod posterior_coverage;
pub mod quadrics;
pub mod sphere;
pub mod sphere_orders;
pub mod square;
pub mod torus_fibonacci;
pub mod torus_random;
pub mod triangle;

#[cfg(test)]
mod bounds;
mod curves;
mod errors;
mod random;
mod shapes;
mod support;
mod table;
mod torus;
