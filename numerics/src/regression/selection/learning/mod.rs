//! Kernel and noise learned from the values themselves, for clients that name neither.
//!
//! A grid of smoothness, length scale, and ratio of noise to variance is searched. Its cells are compared by
//! the restricted likelihood of the values, with mean and variance profiled out. A few hundred values cannot
//! distinguish anything finer than the grid. A factorization depends on these three alone, so other values on
//! the same cloud mostly find theirs in the cache. Smoothness matters most: for smooth fields, Matérn 5/2 has
//! errors three to a hundred times those of Gauss, and its bands are too long (docs/error-bars.md).
//!
//! The grid is searched on a sample first, then from there on all values. Few values are taken together, more
//! in groups that explain each other (order.rs). A sample alone misses local features: from 256 of 2,000
//! values, a plane with a bump looks like a plane with noise. Even in the likelihood of all values, a small
//! place is outvoted. The result therefore has to agree with every place (agreement.rs).

mod agreement;
mod autocorrelation;
mod columns;
mod comparison;
mod grid;
mod group;
mod likelihood;
mod order;
mod price;
mod replicates;
mod search;
mod values;

use crate::error::Result;
use crate::kernel::{Family, Kernel};
use crate::machine::heap::vec_bytes;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::duplicates::RowCopy;
use crate::points::sampling::Sampling;
use crate::regression::solver::Disagreement;
use crate::regression::solver::trend::{Mean, Trend};
use agreement::CellChoice;
use comparison::Comparison;
use grid::is_least_variance;
use values::Values;

pub use columns::is_table;
pub use price::learning_price;

/// Least ratio of noise to variance that is told from none.
const LEAST_RATIO: f64 = 1e-10;

/// Prior knowledge of the noise of values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Noise<'a> {
    /// Nothing is known.
    Unknown,
    /// Variance of the noise, the same at every point, unit V².
    Uniform(f64),
    /// Variance of the noise at each point, `[n]`, unit V².
    PerPoint(&'a [f64]),
}

/// Values at the points of a cloud, with what is known of noise and mean.
#[derive(Clone, Copy)]
pub struct ObservedCloud<'a> {
    pub cloud: &'a Cloud,
    pub sampling: &'a Sampling,
    /// Values `[n]`, unit V. Or `[k, n]`: k lists with a common kernel and noise.
    pub values: &'a [f64],
    pub noise: Noise<'a>,
    pub mean: Mean,
}

impl ObservedCloud<'_> {
    /// Checks that the values are one or more complete lists.
    ///
    /// # Errors
    /// `NumericsError::LengthMismatch` if there is no list, or an incomplete one.
    fn check(&self) -> Result<()> {
        let n = self.cloud.n_points();
        if self.values.len() >= n && self.values.len().is_multiple_of(n) {
            Ok(())
        } else {
            self.cloud.check_one_per_point(self.values)
        }
    }
}

/// Kernel, noise and mean that were learned from values.
#[derive(Debug, Clone, PartialEq)]
pub struct LearnedModel {
    pub family: Family,
    /// ℓ, unit L. The shortest one, if each column has its own.
    pub length_scale: f64,
    /// ℓ_c of each column, `[d]`, unit L, or `None` if all columns share one.
    pub length_scales: Option<Vec<f64>>,
    /// Variance of the noise over that of the process. 0 if the noise is known to be 0. For noise that
    /// differs between points, its mean counts.
    pub ratio: f64,
    /// Variance of the process, unit V². If the noise is known, exactly the variance that gives the ratio.
    pub variance: f64,
    /// The rows that repeat position and values of an earlier one, ascending. Nothing was learned from them,
    /// and a fit is better without them ([`crate::points::duplicates::Merge::copies`]).
    pub copies: Vec<RowCopy>,
    /// Mean found by all groups, for solvers that never see all values at once.
    pub trend: Option<Trend>,
    /// Disagreement of the groups with kernel and noise, for the same solvers.
    pub disagreement: Option<Disagreement>,
}

impl LearnedModel {
    /// Returns the kernel with some variance, unit V².
    ///
    /// # Errors
    /// `NumericsError::InvalidKernelParameter`.
    pub fn kernel(&self, variance: f64) -> Result<Kernel> {
        match &self.length_scales {
            None => Kernel::new(self.family, self.length_scale, variance),
            Some(length_scales) => Kernel::of_axes(self.family, length_scales, variance),
        }
    }

    /// Returns whether the values are so small that their variance was raised to the least one.
    pub fn has_least_variance(&self) -> bool {
        is_least_variance(self.variance)
    }

    /// Bytes held on the heap.
    pub fn n_bytes(&self) -> usize {
        self.trend.as_ref().map_or(0, Trend::n_bytes)
            + vec_bytes(&self.copies)
            + self.length_scales.as_ref().map_or(0, vec_bytes)
    }
}

/// Least number of values that decide anything.
const LEAST_VALUES: usize = 8;

/// Learns kernel and noise from values.
///
/// Constant values decide nothing, nor do fewer than eight. The result is then Matérn 5/2 of the default
/// length scale with the least noise.
///
/// ```
/// use gramian_numerics::observer::Unobserved;
/// use gramian_numerics::points::cloud::Cloud;
/// use gramian_numerics::points::sampling::Sampling;
/// use gramian_numerics::regression::selection::{Noise, ObservedCloud, learn};
/// use gramian_numerics::regression::solver::trend::Mean;
///
/// let cloud = Cloud::new((0..100).map(|i| f64::from(i) / 10.0).collect(), 1)?;
/// let values: Vec<f64> = cloud.points().map(|x| x[0].sin()).collect();
/// let sampling = Sampling::of(&cloud, &Unobserved)?;
/// let (noise, mean) = (Noise::Unknown, Mean::Constant);
/// let observed = ObservedCloud { cloud: &cloud, sampling: &sampling, values: &values, noise, mean };
/// let learned = learn(observed, &Unobserved)?;
/// assert!(learned.length_scale > 0.5 && learned.ratio < 1e-3); // a wave that is nearly without noise
/// # Ok::<(), gramian_numerics::error::NumericsError>(())
/// ```
///
/// # Errors
/// `NumericsError::Cancelled`, `NumericsError::LengthMismatch`, `NumericsError::MeanNotDetermined`.
/// `NumericsError::WeightsOverflow` for values whose squares exceed float64.
pub fn learn(observed: ObservedCloud<'_>, observer: &dyn Observer) -> Result<LearnedModel> {
    let learn = if is_table(observed.cloud) { columns::decided } else { columns::decided_alike };
    learn_by(observed, learn, observer)
}

/// Learns as [`learn`] does, with one length scale for all columns.
///
/// # Errors
/// Returns the errors of [`learn`].
pub fn learn_alike(observed: ObservedCloud<'_>, observer: &dyn Observer) -> Result<LearnedModel> {
    learn_by(observed, columns::decided_alike, observer)
}

/// A comparison of kernels and what it decided, if the values decide anything.
type Outcome<'a> = (Comparison<'a>, Option<CellChoice>);

fn learn_by(
    observed: ObservedCloud<'_>,
    decide: for<'a> fn(&'a Values<'a>, &dyn Observer) -> Result<Outcome<'a>>,
    observer: &dyn Observer,
) -> Result<LearnedModel> {
    observed.check()?;
    let values = Values::of(observed);
    let n_positions = observed.sampling.neighbours().n_positions();
    let (comparison, decided) = if n_positions < LEAST_VALUES || values.is_constant() {
        (Comparison::of(&values, observer)?, None)
    } else {
        decide(&values, observer)?
    };
    let learned = decided.map_or_else(|| comparison.undecided(), |decided| decided.learned);
    let kernel = learned.kernel(1.0)?;
    comparison.concluded(&kernel, LearnedModel { copies: values.copies(), ..learned }, observer)
}

/// Finds the mean of values under a given kernel and noise.
///
/// # Errors
/// `NumericsError::Cancelled`, `NumericsError::LengthMismatch`, `NumericsError::MeanNotDetermined`.
pub fn learn_mean(
    observed: ObservedCloud<'_>,
    kernel: &Kernel,
    observer: &dyn Observer,
) -> Result<LearnedModel> {
    observed.check()?;
    let variance = kernel.variance();
    let ratio = match observed.noise {
        Noise::Unknown => 0.0,
        Noise::Uniform(alpha) => alpha / variance,
        Noise::PerPoint(all) => all.iter().sum::<f64>() / all.len() as f64 / variance,
    };
    let values = Values::of(observed);
    let given = LearnedModel {
        family: kernel.family(),
        length_scale: kernel.length_scale(),
        length_scales: kernel.length_scales().map(<[f64]>::to_vec),
        ratio,
        variance,
        copies: Vec::new(),
        trend: None,
        disagreement: None,
    };
    Comparison::of(&values, observer)?.concluded(&kernel.clone().of_variance_one(), given, observer)
}

#[cfg(test)]
mod tests;
