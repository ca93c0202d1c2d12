//! Values on which kernels are compared.

use super::replicates::{Replicate, Replicates, Rows, Scatter};
use super::{Noise, ObservedCloud};
use crate::points::duplicates::RowCopy;
use crate::regression::solver::trend::Basis;

/// Largest number of lists of values that are looked at. With one noise and one kernel for all, more lists
/// say nothing new.
pub(super) const MAX_LISTS: usize = 16;

/// Lists of values without their averages, in units of the greatest value that is left.
pub(super) struct Values<'a> {
    pub(super) observed: ObservedCloud<'a>,
    lists: Vec<&'a [f64]>,
    /// Average of each list, `[k]`, unit V. 0 if the process has no mean.
    shared: Vec<f64>,
    /// Greatest value without the average, unit V.
    pub(super) unit: f64,
    /// Mean square of the values in units of the greatest. Values contradict a process and noise that
    /// together have less variance.
    pub(super) mean_square: f64,
    /// Mean of the noise variances, unit V². `None` unless they are given per point.
    mean_noise: Option<f64>,
    replicates: Replicates,
    pub(super) basis: Basis,
}

impl<'a> Values<'a> {
    pub(super) fn of(observed: ObservedCloud<'a>) -> Self {
        let n = observed.cloud.n_points();
        let basis = Basis::of(observed.mean, observed.cloud);
        let lists = observed.values.chunks_exact(n);
        let every = lists.len().div_ceil(MAX_LISTS);
        let lists: Vec<&[f64]> = lists.step_by(every).collect();
        let has_mean = basis.n_functions() > 0;
        let mean = |list: &&[f64]| if has_mean { list.iter().sum::<f64>() / n as f64 } else { 0.0 };
        let shared: Vec<f64> = lists.iter().map(mean).collect();
        let rest = || lists.iter().zip(&shared).flat_map(|(list, mean)| list.iter().map(move |v| v - mean));
        let greatest = rest().fold(0.0f64, |greatest, value| greatest.max(value.abs()));
        let in_units = |value: f64| if greatest > 0.0 { value / greatest } else { value };
        let mean_square = rest().map(|value| in_units(value).powi(2)).sum::<f64>() / (lists.len() * n) as f64;
        let mean_noise = match observed.noise {
            Noise::PerPoint(variances) => Some(variances.iter().sum::<f64>() / n as f64),
            Noise::Unknown | Noise::Uniform(_) => None,
        };
        let mean_square = mean_square.max(f64::MIN_POSITIVE);
        let rows = Rows {
            lists: &lists,
            noise: |point| relative_noise(observed.noise, mean_noise, point),
            unit: greatest,
            mean_square,
        };
        let replicates = Replicates::of(&observed, &rows);
        Self { observed, lists, shared, unit: greatest, mean_square, mean_noise, replicates, basis }
    }

    /// The rows that repeat position and values of an earlier one, ascending.
    pub(super) fn copies(&self) -> Vec<RowCopy> {
        self.replicates.copies()
    }

    /// Returns what the rows at the position of its first point say together. `None` where there is one row.
    pub(super) fn replicate(&self, first: usize) -> Option<&Replicate> {
        self.replicates.at(first)
    }

    /// Returns the variance of the noise by the scatter of rows at one position, in units of the square of
    /// the greatest value. `None` where no position has rows that differ.
    pub(super) fn scattered_variance(&self) -> Option<f64> {
        let Scatter { squares, n_degrees } = self.replicates.scatter();
        (n_degrees > 0).then(|| squares / n_degrees as f64)
    }

    pub(super) fn n_lists(&self) -> usize {
        self.lists.len()
    }

    /// Returns the value of a list at the position of its first point, in units of the greatest.
    pub(super) fn at(&self, list: usize, first: usize) -> f64 {
        let value = self.replicate(first).map_or(self.lists[list][first], |rows| rows.means[list]);
        let rest = value - self.shared[list];
        if self.unit > 0.0 { rest / self.unit } else { rest }
    }

    /// Returns the average of the first list, unit V.
    pub(super) fn first_shared(&self) -> f64 {
        self.shared[0]
    }

    /// Returns the noise variances at the positions of some first points, in units of the mean of all rows.
    /// `None` if all are 1.
    pub(super) fn relative_noise(&self, firsts: &[usize]) -> Option<Vec<f64>> {
        if self.mean_noise.is_none() && self.replicates.is_empty() {
            return None;
        }
        let of_row = |point: usize| relative_noise(self.observed.noise, self.mean_noise, point);
        let relative =
            |&first: &usize| self.replicate(first).map_or_else(|| of_row(first), |rows| rows.noise);
        Some(firsts.iter().map(relative).collect())
    }

    /// Returns whether all values are 0.
    pub(super) fn is_zero(&self) -> bool {
        self.unit == 0.0 && self.shared.iter().all(|&shared| shared == 0.0)
    }

    /// Returns whether the values leave nothing to explain.
    pub(super) fn is_constant(&self) -> bool {
        let is_equal = || self.lists.iter().all(|list| list.iter().all(|&value| value == list[0]));
        self.unit == 0.0 || (self.basis.n_functions() > 0 && is_equal())
    }
}

/// Returns the noise variance of a row in units of the mean of all rows.
fn relative_noise(noise: Noise<'_>, mean: Option<f64>, point: usize) -> f64 {
    match (noise, mean) {
        (Noise::PerPoint(variances), Some(mean)) if mean > 0.0 => variances[point] / mean,
        _ => 1.0,
    }
}
