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
mod leave_one_out;
mod likelihood;
mod matrices;
mod parameters;
mod price;
mod sample;
mod search;
mod select;
mod space;
mod spectrum;
mod subject;
mod walk;

use crate::numerics::error::NumericsError;
use crate::numerics::kernel::{Family, Kernel};
use crate::numerics::observer::Observer;
use crate::numerics::points::cloud::Cloud;
use crate::numerics::points::sampling::Sampling;
use crate::numerics::solver::trend::{Mean, Trend};
use sample::Sample;
use search::{Grid, Search};

pub use alpha_path::{alpha_path, default_alphas};
pub use criterion::Criterion;
pub use descent::Side;
pub use leave_one_out::{LeaveOneOut, leave_one_out, leave_one_out_with};
pub use parameters::{Hyperparameters, Parameter, Variation};
pub use price::{alpha_path_price, expected_evaluations, leave_one_out_price, selection_price};
pub use sample::MAX_SAMPLE;
pub use select::{MAX_EVALUATIONS, Selected, Selection, select};

/// What is known of the noise of values beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Noise<'a> {
    /// Nothing.
    Unknown,
    /// Its variance, the same everywhere; unit V².
    Uniform(f64),
    /// Its variance at each point, `[n]`, unit V².
    PerPoint(&'a [f64]),
}

/// Values at the points of a cloud, and what is known of them.
#[derive(Clone, Copy)]
pub struct Observed<'a> {
    pub cloud: &'a Cloud,
    pub sampling: &'a Sampling,
    /// `[n]`, unit V; or `[k, n]`, k lists that have kernel and noise in common.
    pub values: &'a [f64],
    pub noise: Noise<'a>,
    pub mean: Mean,
}

impl Observed<'_> {
    /// # Errors
    /// [`NumericsError::LengthMismatch`] for no list, or one that is not whole.
    fn check(&self) -> Result<(), NumericsError> {
        let n = self.cloud.n_points();
        match self.values.len() >= n && self.values.len().is_multiple_of(n) {
            true => Ok(()),
            false => self.cloud.check_one_per_point(self.values),
        }
    }
}

/// What the values decide.
#[derive(Debug, Clone, PartialEq)]
pub struct Learned {
    pub family: Family,
    /// ℓ, unit L.
    pub length_scale: f64,
    /// Variance of the noise over that of the process, 0 if the noise is known to be 0; where it differs between points, of its mean.
    pub ratio: f64,
    /// The variance of the process as the sample has it, unit V²; exactly what it has to be for the ratio where the noise is known.
    pub variance: f64,
    /// The mean as the sample has it: for solvers that never see all values at once.
    pub trend: Option<Trend>,
}

impl Learned {
    /// Bytes held on the heap.
    pub fn n_bytes(&self) -> usize {
        self.trend.as_ref().map_or(0, Trend::n_bytes)
    }
}

/// Fewer values decide nothing.
const LEAST_VALUES: usize = 8;

/// Learns kernel and noise from values, or rather from [`MAX_SAMPLE`] of them.
///
/// Values that do not differ decide nothing, nor do few: Matérn 5/2 of the default length scale with the least noise.
///
/// # Errors
/// [`NumericsError::Cancelled`], [`NumericsError::LengthMismatch`].
pub fn learn(observed: Observed<'_>, observer: &dyn Observer) -> Result<Learned, NumericsError> {
    observed.check()?;
    let sample = Sample::of(&observed);
    let grid = Grid::of(&observed);
    let undecided = grid.undecided(&observed, &sample);
    let learned = match sample.n_points() < LEAST_VALUES || sample.is_constant() {
        true => undecided,
        false => Search::new(&sample, grid).run(observer)?.unwrap_or(undecided),
    };
    let kernel = Kernel::new(learned.family, learned.length_scale, 1.0)?;
    let trend = sample.trend(&observed, kernel, learned.ratio, observer)?;
    Ok(Learned { trend, ..learned })
}

/// Cells of the grid that are looked at, mostly.
const CELLS: f64 = 70.0;

/// Flops of [`learn`] for n values.
pub fn learning_flops(n_points: usize) -> f64 {
    let n = n_points.min(MAX_SAMPLE) as f64;
    CELLS * n * n * (n / 3.0 + 20.0) + n_points as f64
}

/// The mean of values under a kernel and a noise that are given, as [`MAX_SAMPLE`] of them have it, with these.
///
/// # Errors
/// [`NumericsError::Cancelled`], [`NumericsError::LengthMismatch`], [`NumericsError::MeanNotDetermined`].
pub fn learn_mean(
    observed: Observed<'_>,
    kernel: &Kernel,
    observer: &dyn Observer,
) -> Result<Learned, NumericsError> {
    observed.check()?;
    let variance = kernel.variance();
    let ratio = match observed.noise {
        Noise::Unknown => 0.0,
        Noise::Uniform(alpha) => alpha / variance,
        Noise::PerPoint(all) => all.iter().sum::<f64>() / all.len() as f64 / variance,
    };
    let trend = Sample::of(&observed).trend(&observed, kernel.clone(), ratio, observer)?;
    Ok(Learned { family: kernel.family(), length_scale: kernel.length_scale(), ratio, variance, trend })
}

#[cfg(test)]
mod tests;
