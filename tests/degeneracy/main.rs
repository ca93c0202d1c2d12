//! Where geometry is doubtful: right, or flagged.

#[path = "../common/mod.rs"]
mod common;

mod clouds;
mod flat;
mod orientation;
mod shapes;
mod support;
mod sweep;
mod sweeps;
