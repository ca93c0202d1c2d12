//! Where geometry is doubtful: right, or flagged.

mod shapes;
mod sweep;
mod sweeps;
