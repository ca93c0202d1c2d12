//! Geometry in doubtful cases: answers are right, or flagged.

#[path = "../common/mod.rs"]
mod common;

mod closed;
mod clouds;
mod flat;
mod normals;
mod orientation;
mod shapes;
mod sizes;
mod support;
mod sweep;
mod sweeps;
