//! Functions on space from a solved system: their values, derivatives and uncertainty.

pub mod batch;
pub mod deviations;
pub(crate) mod errors;
pub(crate) mod functionals;
pub mod interpolant;
mod mean_variance;
pub mod moving;
mod pivoted_root;
pub mod posterior;
pub mod price;
pub mod samples;

#[cfg(test)]
mod mean_tests;
