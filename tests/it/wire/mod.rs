//! Tests of what goes over the wire: bodies, limits, refusals, protocols.

mod bodies;
mod hostile;
pub mod limits;
mod problems;
mod protocol;
mod refusals;
mod renamed;
