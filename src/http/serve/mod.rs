//! The way of a request from its body to its answer, the same for every operation.

pub mod operation;
pub mod steps;

pub mod answers;
pub mod durable;

pub mod fitted;
pub mod fitting;
pub mod plan;
pub mod planner;
pub mod sampling;

#[cfg(test)]
mod tests;
