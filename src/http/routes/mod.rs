//! One file per resource: request, response, handler, in that order.

pub mod clouds;
pub mod estimate;
mod gauges;
pub mod jobs;
pub mod kernels;
pub mod pages;
pub mod process;
pub mod reading;
pub mod surface;
pub mod values;
