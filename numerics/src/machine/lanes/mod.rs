//! Small systems side by side: each lane of a register holds one of several systems of equal size.
//!
//! A system is a lower triangle with rows of right-hand sides below it, one register an entry. The Cholesky
//! factorization K = LLᵀ turns the rows below into their products with L⁻ᵀ. What a system is solved for then
//! follows from inner products of these rows.

mod factor;
mod lower;
mod workspace;

pub(crate) use factor::{COLUMNS, Rounding};
pub(crate) use lower::{Layout, Lower};
pub(crate) use workspace::Workspace;

/// Numbers in the widest register.
pub(crate) const MAX_LANES: usize = 8;

/// Number of entries of a lower triangle with n rows, and the start of row n in it.
pub(crate) const fn triangle(n: usize) -> usize {
    n * (n + 1) / 2
}
