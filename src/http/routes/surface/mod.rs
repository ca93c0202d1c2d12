//! Routes about surfaces: normals, curvatures, and operators on values over a surface.

mod common;
pub mod curvatures;
mod doubts;
pub mod laplace_beltrami;
pub mod level_set;
pub mod normals;
mod operator;
pub mod surface_gradient;
