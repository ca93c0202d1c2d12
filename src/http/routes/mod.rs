//! Routes, one file per resource. Each file has request, response and handler, in that order.

pub mod clouds;
pub mod estimate;
mod gauges;
pub mod jobs;
pub mod kernels;
mod operation;
pub mod pages;
pub mod process;
pub mod reading;
pub mod surface;
pub mod tiles;
pub mod values;
