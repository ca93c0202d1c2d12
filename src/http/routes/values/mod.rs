//! Routes about values at points: interpolation, Gaussian process posteriors, and selection of
//! hyperparameters.

pub mod interpolation;
pub mod model_selection;
pub mod posterior;
