//! How requests are served: the way of each from its body to its answer.

mod diagnostics;
pub mod durable;

pub mod operation;

pub mod fitted;
pub mod fitting;
pub mod intake;
pub mod plan;
pub mod planner;
pub mod sampling;
pub mod surface;
pub mod values;

mod report;
