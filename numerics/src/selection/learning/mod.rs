//! Kernel and noise from the values themselves, for whoever says nothing.
//!
//! The restricted likelihood of the values, the mean and the variance profiled out of it, is compared over a
//! grid: smoothness, length scale, and the ratio of noise to variance. Nothing finer than the grid is told
//! apart by a few hundred values, and since a factorization depends on these three alone, other values on the
//! same cloud mostly find theirs in the cache. Smoothness matters most: for smooth fields a Matérn 5/2 is off
//! by three to a hundred times what Gauss is, and has bands that are too long (docs/error-bars.md).
//!
//! The grid is searched on a sample first, then from there on all values: together while they are few, else
//! in groups that explain each other (order.rs). A sample alone misses what is local: from 256 of 2,000
//! values a plane with a bump looks like a plane with noise. Even the likelihood of all values outvotes a
//! small place, so what was found has to agree with every place (agreement.rs).

mod agreement;
mod grid;
mod group;
mod likelihood;
mod order;
mod price;
mod search;
mod values;

use crate::error::NumericsError;
use crate::kernel::{Family, Kernel};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::sampling::Sampling;
use crate::solver::Disagreement;
use crate::solver::trend::{Mean, Trend};
use agreement::Agreement;
use grid::{Grid, is_least_variance};
use likelihood::Evidence;
use order::Order;
use search::Search;
use values::Values;

pub(super) use likelihood::remove_mean;
pub use price::learning_price;

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
    /// Variance of the noise over that of the process, 0 if the noise is known to be 0; where it differs
    /// between points, of its mean.
    pub ratio: f64,
    /// The variance of the process, unit V²; exactly what it has to be for the ratio where the noise is known.
    pub variance: f64,
    /// The mean as all groups have it: for solvers that never see all values at once.
    pub trend: Option<Trend>,
    /// How the groups contradict kernel and noise, for the same solvers.
    pub disagreement: Option<Disagreement>,
}

impl Learned {
    /// Whether values are so small that the variance is greater than they say.
    pub fn has_least_variance(&self) -> bool {
        is_least_variance(self.variance)
    }

    /// Bytes held on the heap.
    pub fn n_bytes(&self) -> usize {
        self.trend.as_ref().map_or(0, Trend::n_bytes)
    }
}

/// Fewer values decide nothing.
const LEAST_VALUES: usize = 8;

/// Learns kernel and noise from values.
///
/// Values that do not differ decide nothing, nor do few: Matérn 5/2 of the default length scale with the
/// least noise.
///
/// # Errors
/// [`NumericsError::Cancelled`], [`NumericsError::LengthMismatch`], [`NumericsError::MeanNotDetermined`],
/// [`NumericsError::WeightsOverflow`] of values whose square leaves float64.
pub fn learn(observed: Observed<'_>, observer: &dyn Observer) -> Result<Learned, NumericsError> {
    observed.check()?;
    let values = Values::of(observed);
    let order = Order::of(&observed, observer)?;
    let all = Evidence::of(&values, &order.searched);
    let decided = match observed.cloud.n_points() < LEAST_VALUES || values.is_constant() {
        true => None,
        false => search(&all, &order, observer)?,
    };
    let learned = decided.unwrap_or_else(|| Grid::of(&values).undecided(&values));
    let kernel = Kernel::new(learned.family, learned.length_scale, 1.0)?;
    all.concluded(&kernel, learned, observer)
}

/// On all values, or on a sample and from there on all values in groups.
fn search(
    all: &Evidence<'_>,
    order: &Order,
    observer: &dyn Observer,
) -> Result<Option<Learned>, NumericsError> {
    let (values, grid) = (all.values, Grid::of(all.values));
    let deep = Evidence::of(values, &order.deep);
    let mut agreement = Agreement {
        all: Search::new(all, &grid),
        deep: (!order.deep.is_empty()).then(|| Search::new(&deep, &grid)),
        grid: &grid,
        unit: values.unit,
    };
    let best = match order.searched.as_slice() {
        [first, _, ..] => {
            let sample = Evidence::of(values, std::slice::from_ref(first));
            let mut on_sample = Search::new(&sample, &grid);
            let Some(best) = on_sample.best(observer)? else { return Ok(None) };
            let Some(begin) = on_sample.least_of(best.into_iter(), observer)? else { return Ok(None) };
            Some(agreement.all.best_from(begin, observer)?)
        }
        _ => agreement.all.best(observer)?,
    };
    best.map_or(Ok(None), |best| agreement.decided(best, observer))
}

/// The mean of values under a kernel and a noise that are given.
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
    let values = Values::of(observed);
    let order = Order::of(&observed, observer)?;
    let given = Learned {
        family: kernel.family(),
        length_scale: kernel.length_scale(),
        ratio,
        variance,
        trend: None,
        disagreement: None,
    };
    Evidence::of(&values, &order.searched).concluded(&kernel.clone().of_variance_one(), given, observer)
}

#[cfg(test)]
mod tests;
