//! Model selection: the choice of a kernel, its hyperparameters and the noise, from values.
//!
//! [`learn`] serves clients that name no kernel. It searches a grid of kernels and noises, coarse enough that
//! different values share cached factorizations. [`select()`] maximises a [`Criterion`] of all values over
//! hyperparameters, in n³ flops for every evaluation. [`alpha_path()`] scores many α for one kernel.
//! [`leave_one_out()`] predicts each value from all others.

mod alpha_path;
mod criterion;
mod evaluation;
mod learning;
mod leave_one_out;
mod parameters;
mod price;
mod prior;
mod search;
mod subject;

pub use alpha_path::{alpha_path, default_alphas};
pub use criterion::Criterion;
pub use learning::{
    LearnedModel, Noise, ObservedCloud, is_table, learn, learn_alike, learn_mean, learning_price,
};
pub use leave_one_out::{LeaveOneOut, leave_one_out, leave_one_out_with};
pub use parameters::{Hyperparameters, Parameter, Variation};
pub use price::{
    CloudSize, SearchSize, alpha_path_price, expected_evaluations, leave_one_out_price, selection_price,
};
pub use prior::ScalePrior;
pub use search::{MAX_EVALUATIONS, SearchResult, Selection, Side, select};
pub use subject::Observations;
