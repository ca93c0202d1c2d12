//! Resources of values at points: interpolation, the process they are taken to be, and its hyperparameters.

pub mod interpolation;
pub mod model_selection;
pub mod posterior;
