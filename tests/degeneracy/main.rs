//! Where geometry is doubtful: right, or flagged.

#[path = "../common/random.rs"]
mod random;

mod clouds;
mod flat;
mod orientation;
mod shapes;
mod support;
mod sweep;
mod sweeps;
