//! Which kernel and how much noise values want.
//!
//! The restricted likelihood of the values, the mean and the variance profiled out of it, is compared over a grid: smoothness, length scale, and
//! the ratio of noise to variance. Nothing finer than the grid is told apart by a few hundred values, and since a factorization depends on these
//! three alone, other values on the same cloud mostly find theirs in the cache. Smoothness matters most: for smooth fields a Matérn 5/2 is off by
//! three to a hundred times what Gauss is, and has bands that are too long (docs/error-bars.md).
//!
//! That is [`learn`], for whoever says nothing. [`select()`] searches the best hyperparameters of all values by a [`Criterion`], in n³ flops for every
//! evaluation; [`alpha_path()`] looks at many α for one kernel, and [`leave_one_out()`] predicts each value from all others.

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
mod space;
mod spectrum;
mod subject;
mod walk;

pub use alpha_path::{alpha_path, default_alphas};
pub use criterion::Criterion;
pub use descent::Side;
pub use learning::{Learned, Noise, Observed, learn, learn_mean, learning_flops};
pub use leave_one_out::{LeaveOneOut, leave_one_out, leave_one_out_with};
pub use parameters::{Hyperparameters, Parameter, Variation};
pub use price::{alpha_path_price, expected_evaluations, leave_one_out_price, selection_price};
pub use select::{MAX_EVALUATIONS, Selected, Selection, select};
