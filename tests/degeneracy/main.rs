//! Where geometry is doubtful: right, or flagged.

mod clouds;
mod flat;
mod orientation;
mod shapes;
mod support;
mod sweep;
mod sweeps;
