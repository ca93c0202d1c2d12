//! What a solved system says as a function on space: its values, and how sure they are.

pub mod batch;
pub mod deviations;
pub(crate) mod errors;
pub(crate) mod functionals;
pub mod interpolant;
mod mean_variance;
pub mod moving;
mod pivoted_root;
pub mod posterior;
pub mod samples;

#[cfg(test)]
mod mean_tests;
