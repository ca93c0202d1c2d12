//! Winding numbers of an oriented cloud, and the signs of parts that they ask for.

mod areas;
mod dipoles;
pub(super) mod field;
pub(super) mod gauss;
pub(super) mod numbers;
pub(super) mod turns;
