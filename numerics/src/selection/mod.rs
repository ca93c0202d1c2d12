//! Which kernel and how much noise values want.
//!
//! [`learn`] is for whoever says nothing: a grid of kernels and noises, coarse enough for a cache. [`select()`] searches the best
//! hyperparameters of all values by a [`Criterion`], in n³ flops for every evaluation; [`alpha_path()`] looks at many α for one
//! kernel, and [`leave_one_out()`] predicts each value from all others.

mod alpha_path;
mod contraction;
mod criterion;
mod descent;
mod evaluation;
mod learning;
mod leave_one_out;
mod matrices;
mod parameters;
mod price;
mod select;
mod served;
mod space;
mod spectrum;
mod subject;
mod walk;

pub use alpha_path::{alpha_path, default_alphas};
pub use criterion::Criterion;
pub use descent::Side;
pub use learning::{Learned, Noise, Observed, learn, learn_mean, learning_price};
pub use leave_one_out::{LeaveOneOut, leave_one_out, leave_one_out_with};
pub use parameters::{Hyperparameters, Parameter, Variation};
pub use price::{alpha_path_price, expected_evaluations, leave_one_out_price, selection_price};
pub use select::{MAX_EVALUATIONS, Selected, Selection, select};
