//! Choice of the landmarks.

use faer::{Mat, MatRef};

use super::Weighing;
use super::rows::Rows;
use crate::error::{NumericsError, Result};
use crate::kernel::Kernel;
use crate::machine::random::Random;
use crate::observer::Observer;
use crate::regression::solver::dense::{PIVOT_TOLERANCE, Pivoting, Tolerance};
use crate::regression::solver::system::System;
use crate::regression::sums::regularization::Regularization;

/// Points among which landmarks are chosen.
pub(super) const SAMPLE: usize = 10_000;

/// Points at which the landmarks are looked at before all points are, or fewer than twice as many.
const LOOKED_AT: usize = 50_000;

/// Most landmarks, over the number of points among which they are chosen. With more, their matrix is no
/// smaller task than that of all points.
const MOST: f64 = 0.25;

/// Least number of landmarks that is allowed, for clouds of few points.
const LEAST_MOST: usize = 1_000;

/// What may remain of the diagonal, over what the choice among a sample leaves there. Elsewhere more remains,
/// and a choice that has to be completed costs another pass over all points.
const SPARE: f64 = 8.0;

/// Part of what may remain from which a point that is looked at beforehand asks for more landmarks.
const SUSPECT: f64 = 0.5;

/// Seed of the sample.
const SEED: u64 = 33;

/// Part of the smallest noise that may remain of the diagonal, where there are as many landmarks as points.
/// The largest relative error of a variance is about `τ/α · n/r`.
const PART_OF_NOISE: f64 = 1e-6;

/// Largest share of landmarks among the points at which that part still falls with them.
const LARGEST_SHARE: f64 = 1e-2;

/// Landmarks with what may remain of the diagonal.
pub(super) struct LandmarkChoice {
    pub rows: Rows,
    /// τ, V².
    pub tolerance: f64,
}

impl LandmarkChoice {
    /// Chooses among a sample of the points.
    ///
    /// # Errors
    /// [`NumericsError::RankTooLarge`], [`NumericsError::Cancelled`].
    pub(super) fn among_sample(system: &System, observer: &dyn Observer) -> Result<Self> {
        let points = sampled(system.n_points(), SAMPLE);
        Self::among(system, points, observer)
    }

    /// Points of another sample at which too much remains.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(super) fn beyond_at_some(&self, system: &System, observer: &dyn Observer) -> Result<Vec<usize>> {
        let n = system.n_points();
        let step = (n / LOOKED_AT).max(1);
        let points: Vec<usize> = (0..n).step_by(step).collect();
        let some = system.at(&points)?;
        let mut beyond = Vec::new();
        self.rows.for_each_block(&some, observer, |range, block| {
            for (at, remaining) in range.zip(block.remaining) {
                if *remaining > SUSPECT * self.tolerance {
                    beyond.push(points[at]);
                }
            }
        })?;
        Ok(beyond)
    }

    /// Chooses again, among the landmarks and points at which too much remains.
    ///
    /// # Errors
    /// [`NumericsError::RankTooLarge`], [`NumericsError::Cancelled`].
    pub(super) fn completed(
        &self,
        system: &System,
        beyond: &[usize],
        observer: &dyn Observer,
    ) -> Result<Self> {
        let mut points = self.rows.points().to_vec();
        points.extend(beyond.iter().take(SAMPLE));
        points.sort_unstable();
        points.dedup();
        Self::among(system, points, observer)
    }

    fn among(system: &System, points: Vec<usize>, observer: &dyn Observer) -> Result<Self> {
        let (kernel, sample, n) = (system.kernel(), system.cloud().select(&points), points.len());
        let most = most_landmarks(n);
        let tolerance = tolerance(system.n_points(), kernel, system.regularization());
        let mut columns = vec![0.0; n * most];
        let exact = Regularization::Uniform(0.0);
        let pivots =
            Pivoting::new(&sample, kernel, &exact, &mut columns).to(tolerance).run(most, observer)?;
        if !pivots.is_complete {
            return Err(NumericsError::RankTooLarge { most });
        }
        let (rank, l) = (pivots.rank, MatRef::from_column_major_slice(&columns, n, most));
        let l11 = Mat::from_fn(rank, rank, |i, j| if i < j { 0.0 } else { l[(i, j)] });
        let chosen: Vec<usize> = pivots.order[..rank].iter().map(|&at| points[at]).collect();
        let cloud = system.cloud().select(&chosen);
        let coordinates = Weighing::of(system).coordinates(system);
        let tolerance = SPARE * tolerance.at(rank);
        let mut rows = Rows::of(chosen, cloud, l11, coordinates);
        if n == system.n_points() {
            rows.keep_factor(kernel, l, &pivots.order);
        }
        Ok(Self { rows, tolerance })
    }
}

/// Most landmarks among n points.
pub(super) fn most_landmarks(n: usize) -> usize {
    ((MOST * n as f64) as usize).max(LEAST_MOST).min(n)
}

/// What the choice leaves, as a function of the number of landmarks r: `max(64 ε k₀, 1e-6 α min(r/n,
/// 1e-2)/8)`.
pub(super) fn tolerance(n: usize, kernel: &Kernel, noise: &Regularization) -> Tolerance {
    let positive = (0..n).map(|point| noise.at(point)).filter(|alpha| *alpha > 0.0);
    let smallest = positive.fold(f64::INFINITY, f64::min);
    let part = if smallest.is_finite() { PART_OF_NOISE * smallest / SPARE } else { 0.0 };
    Tolerance {
        rounding: PIVOT_TOLERANCE * kernel.at_zero(),
        per_pivot: part / n as f64,
        most: part * LARGEST_SHARE,
    }
}

/// A random sample of n points, in their order, or all of them if there are no more than that.
pub(super) fn sampled(n: usize, count: usize) -> Vec<usize> {
    let mut points = shuffled(n, count);
    points.sort_unstable();
    points
}

/// A random sample of at most n points, in random order.
pub(super) fn shuffled(n: usize, count: usize) -> Vec<usize> {
    let mut points: Vec<usize> = (0..n).collect();
    let keys: Vec<u64> = (0..n).map(|point| Random::of(SEED, point as u64).next()).collect();
    let by_key = |point: &usize| (keys[*point], *point);
    if n > count {
        points.select_nth_unstable_by_key(count, by_key);
        points.truncate(count);
    }
    points.sort_unstable_by_key(by_key);
    points
}
