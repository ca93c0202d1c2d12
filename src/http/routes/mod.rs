//! One file per resource: request, response, handler, in that order.

pub mod clouds;
pub mod curvatures;
mod doubts;
pub mod estimate;
pub mod interpolation;
pub mod jobs;
pub mod kernels;
pub mod laplace_beltrami;
pub mod model_selection;
pub mod normals;
pub mod pages;
pub mod posterior;
pub mod process;
pub mod surface_gradient;
mod surfaces;
