//! Factorization of the whole matrix: Cholesky, and where that fails, least squares on the pivots of a
//! rank-revealing factorization.

mod cholesky;
mod packed;
mod pivoted_cholesky;
mod pivoting;
mod substitution;

pub(crate) use cholesky::factorize_in_place;
pub(super) use cholesky::{Cholesky, pieces};
pub(super) use pivoted_cholesky::PivotedCholesky;
pub(crate) use pivoting::PIVOT_TOLERANCE;
pub(super) use pivoting::{Pivoting, Step, Tolerance};
