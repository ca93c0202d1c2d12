//! How requests are served: the way of each from its body to its answer.

pub mod durable;
pub mod factors;

pub mod operation;

pub mod fitted;
pub mod fitting;
pub mod intake;
pub mod plan;
pub mod planner;
pub mod sampling;
pub mod values;

mod report;
