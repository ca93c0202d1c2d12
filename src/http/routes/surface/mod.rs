//! Resources of a surface: normals, curvatures, and operators on values over it.

mod common;
pub mod curvatures;
mod doubts;
pub mod laplace_beltrami;
pub mod normals;
mod operator;
pub mod surface_gradient;
