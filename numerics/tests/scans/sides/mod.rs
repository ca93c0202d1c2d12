//! Sides of normals on closed curves and surfaces: they are right, or flagged.

#![allow(dead_code, reason = "the tests and the example each take what they need")]

pub mod cases;
pub mod clouds;
pub mod tally;

#[cfg(test)]
mod tests;
