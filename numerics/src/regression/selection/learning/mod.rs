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
use agreement::Agreement;
use grid::{Grid, is_least_variance};
use likelihood::Evidence;
use order::Order;
use search::Search;
use values::Values;

pub(super) use likelihood::remove_mean;
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
pub struct Observed<'a> {
    pub cloud: &'a Cloud,
    pub sampling: &'a Sampling,
    /// Values `[n]`, unit V. Or `[k, n]`: k lists with a common kernel and noise.
    pub values: &'a [f64],
    pub noise: Noise<'a>,
    pub mean: Mean,
}

impl Observed<'_> {
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
pub struct Learned {
    pub family: Family,
    /// ℓ, unit L.
    pub length_scale: f64,
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

impl Learned {
    /// Returns whether the values are so small that their variance was raised to the least one.
    pub fn has_least_variance(&self) -> bool {
        is_least_variance(self.variance)
    }

    /// Bytes held on the heap.
    pub fn n_bytes(&self) -> usize {
        self.trend.as_ref().map_or(0, Trend::n_bytes) + vec_bytes(&self.copies)
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
/// use gramian_numerics::regression::selection::{Noise, Observed, learn};
/// use gramian_numerics::regression::solver::trend::Mean;
///
/// let cloud = Cloud::new((0..100).map(|i| f64::from(i) / 10.0).collect(), 1)?;
/// let values: Vec<f64> = cloud.points().map(|x| x[0].sin()).collect();
/// let sampling = Sampling::of(&cloud, &Unobserved)?;
/// let (noise, mean) = (Noise::Unknown, Mean::Constant);
/// let observed = Observed { cloud: &cloud, sampling: &sampling, values: &values, noise, mean };
/// let learned = learn(observed, &Unobserved)?;
/// assert!(learned.length_scale > 0.5 && learned.ratio < 1e-3); // a wave that is nearly without noise
/// # Ok::<(), gramian_numerics::error::NumericsError>(())
/// ```
///
/// # Errors
/// `NumericsError::Cancelled`, `NumericsError::LengthMismatch`, `NumericsError::MeanNotDetermined`.
/// `NumericsError::WeightsOverflow` for values whose squares exceed float64.
pub fn learn(observed: Observed<'_>, observer: &dyn Observer) -> Result<Learned> {
    observed.check()?;
    let values = Values::of(observed);
    let order = Order::of(&observed, observer)?;
    let all = Evidence::of(&values, &order.searched);
    let n_positions = observed.sampling.neighbours().n_positions();
    let decided = if n_positions < LEAST_VALUES || values.is_constant() {
        None
    } else {
        search(&all, &order, observer)?
    };
    let learned = decided.unwrap_or_else(|| Grid::of(&values).undecided(&values));
    let kernel = Kernel::new(learned.family, learned.length_scale, 1.0)?;
    all.concluded(&kernel, Learned { copies: values.copies(), ..learned }, observer)
}

/// Searches the grid on all values, or on a sample and from there on all values in groups.
fn search(all: &Evidence<'_>, order: &Order, observer: &dyn Observer) -> Result<Option<Learned>> {
    let (values, grid) = (all.values, Grid::of(all.values));
    let deep = Evidence::of(values, &order.deep);
    let mut agreement = Agreement {
        all: Search::new(all, &grid, observer),
        deep: (!order.deep.is_empty()).then(|| Search::new(&deep, &grid, observer)),
        grid: &grid,
        unit: values.unit,
    };
    let best = match order.searched.as_slice() {
        [first, _, ..] => {
            let sample = Evidence::of(values, std::slice::from_ref(first));
            let mut on_sample = Search::new(&sample, &grid, observer);
            let Some(best) = on_sample.best()? else { return Ok(None) };
            let Some(begin) = on_sample.likeliest(best.into_iter())? else { return Ok(None) };
            Some(agreement.all.best_from(begin)?)
        }
        _ => agreement.all.best()?,
    };
    best.map_or(Ok(None), |best| agreement.decided(best))
}

/// Finds the mean of values under a given kernel and noise.
///
/// # Errors
/// `NumericsError::Cancelled`, `NumericsError::LengthMismatch`, `NumericsError::MeanNotDetermined`.
pub fn learn_mean(observed: Observed<'_>, kernel: &Kernel, observer: &dyn Observer) -> Result<Learned> {
    observed.check()?;
    let variance = kernel.variance();
    let ratio = match observed.noise {
        Noise::Unknown => 0.0,
        Noise::Uniform(alpha) => alpha / variance,
        Noise::PerPoint(all) => all.iter().sum::<f64>() / all.len() as f64 / variance,
    };
    let values = Values::of(observed);
    let order = Order::of(&observed, observer)?;
    let given = Learned {
        family: kernel.family(),
        length_scale: kernel.length_scale(),
        ratio,
        variance,
        copies: Vec::new(),
        trend: None,
        disagreement: None,
    };
    Evidence::of(&values, &order.searched).concluded(&kernel.clone().of_variance_one(), given, observer)
}

#[cfg(test)]
mod tests;
