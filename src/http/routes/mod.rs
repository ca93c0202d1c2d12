//! One file per resource: request, response, handler, in that order.

pub mod clouds;
pub mod interpolation;
pub mod kernels;
pub mod laplace_beltrami;
pub mod operators;
pub mod pages;
pub mod posterior;
pub mod process;
pub mod surface;
pub mod surface_gradient;
