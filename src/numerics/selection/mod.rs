//! Which kernel and how much noise values want.
//!
//! The restricted likelihood of the values, the mean and the variance profiled out of it, is compared over a grid: smoothness, length scale, and
//! the ratio of noise to variance. Nothing finer than the grid is told apart by a few hundred values, and since a factorization depends on these
//! three alone, other values on the same cloud mostly find theirs in the cache. Smoothness matters most: for smooth fields a Matérn 5/2 is off by
//! three to a hundred times what Gauss is, and has bands that are too long (docs/defaults.md).

mod likelihood;
mod sample;
mod search;

use crate::numerics::error::NumericsError;
use crate::numerics::kernel::Family;
use crate::numerics::observer::Observer;
use crate::numerics::points::cloud::Cloud;
use crate::numerics::points::sampling::Sampling;
use crate::numerics::solver::trend::Mean;
use sample::Sample;
use search::{Grid, Search};

pub use sample::MAX_SAMPLE;

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
    /// `[n]`, unit V.
    pub values: &'a [f64],
    pub noise: Noise<'a>,
    pub mean: Mean,
}

/// What the values decide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Learned {
    pub family: Family,
    /// ℓ, unit L.
    pub length_scale: f64,
    /// Variance of the noise over that of the process, 0 if the noise is known to be 0; where it differs between points, of its mean.
    pub ratio: f64,
    /// The variance of the process as the sample has it, unit V²; exactly what it has to be for the ratio where the noise is known.
    pub variance: f64,
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
    observed.cloud.check_one_per_point(observed.values)?;
    let grid = Grid::of(&observed);
    let sample = Sample::of(&observed);
    if sample.values.len() < LEAST_VALUES || sample.is_constant() {
        return Ok(grid.undecided(&observed));
    }
    let undecided = grid.undecided(&observed);
    Ok(Search::new(&sample, grid).run(observer)?.unwrap_or(undecided))
}

#[cfg(test)]
mod tests;
