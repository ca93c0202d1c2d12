//! Functions on space from a solved system: their values, derivatives and uncertainty.

pub mod batch;
pub mod deviations;
pub(crate) mod errors;
pub(crate) mod functionals;
pub mod interpolant;
pub mod local_kriging;
mod mean_variance;
mod pivoted_root;
pub mod posterior;
pub mod price;
pub mod samples;

/// Columns `L⁻¹k(X, ·)` that are held at once, one for each query or functional.
///
/// They bound the memory to 512 numbers a point, and are wide enough for solves to run as matrix products.
pub(crate) const COLUMNS_AT_ONCE: usize = 512;

#[cfg(test)]
mod mean_tests;
