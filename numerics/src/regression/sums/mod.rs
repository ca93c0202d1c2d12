//! Loops over pairs of points: Gram matrices, and sums of kernels with their derivatives.

pub mod expansion;
pub(crate) mod fast;
pub mod gram;
pub mod jets;
pub(crate) mod many;
pub mod nodes;
pub(crate) mod price;
pub mod regularization;
pub(crate) mod side_by_side;
pub(crate) mod symmetric;
