//! Rows that share a position: copies of a row, and repeated measurements.
//!
//! The likelihood of the rows at one position is that of their mean, whose noise has a smaller variance,
//! times that of their scatter around it, which noise alone explains. The second factor grows without bound
//! as the noise vanishes, if there is no scatter. Rows whose values are equal too are therefore taken for
//! copies, as exported tables have them, and count once: taken for measurements, a few of them would say that
//! there is no noise.

use std::cmp::Ordering;

use super::{LEAST_RATIO, ObservedCloud};
use crate::points::duplicates::RowCopy;

/// The rows at all positions that have several.
pub(super) struct Replicates {
    /// Ascending by their first points.
    positions: Vec<Replicate>,
}

/// The rows at a position, taken together.
pub(super) struct Replicate {
    /// The first point at the position, which stands for all of them.
    first: usize,
    /// Mean of the rows in each list, `[k]`, unit V.
    pub(super) means: Vec<f64>,
    /// Variance of the noise of the means, over the mean variance of the noise of all rows.
    pub(super) noise: f64,
    pub(super) scatter: Scatter,
    copies: Vec<RowCopy>,
}

/// The scatter of rows around their means.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Scatter {
    /// Sum of the squares over the relative variances of their noise, in units of the square of the greatest
    /// value.
    pub(super) squares: f64,
    pub(super) n_degrees: usize,
}

impl std::iter::Sum for Scatter {
    fn sum<I: Iterator<Item = Self>>(scatters: I) -> Self {
        scatters.fold(Self::default(), |sum, next| Self {
            squares: sum.squares + next.squares,
            n_degrees: sum.n_degrees + next.n_degrees,
        })
    }
}

/// Rows of values: lists, and the relative variance of the noise of each row.
pub(super) struct Rows<'a, N> {
    pub(super) lists: &'a [&'a [f64]],
    pub(super) noise: N,
    /// The greatest value, unit V.
    pub(super) unit: f64,
    /// Mean square of the values, in its units.
    pub(super) mean_square: f64,
}

impl Replicates {
    pub(super) fn of<N: Fn(usize) -> f64>(observed: &ObservedCloud<'_>, rows: &Rows<'_, N>) -> Self {
        let neighbours = observed.sampling.neighbours();
        let at = (0..neighbours.n_positions()).map(|position| neighbours.points_at(position));
        let several = at.filter(|points| points.len() > 1);
        let mut positions: Vec<Replicate> = several.map(|points| Replicate::of(points, rows)).collect();
        positions.sort_unstable_by_key(|replicate| replicate.first);
        Self { positions }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The scatter of all rows.
    pub(super) fn scatter(&self) -> Scatter {
        self.positions.iter().map(|rows| rows.scatter).sum()
    }

    /// The rows that repeat an earlier one, ascending.
    pub(super) fn copies(&self) -> Vec<RowCopy> {
        let mut copies: Vec<RowCopy> = self.positions.iter().flat_map(|rows| &rows.copies).copied().collect();
        copies.sort_unstable_by_key(|copy| copy.row);
        copies
    }

    /// Returns what the rows at the position of its first point say. `None` where there is one row.
    pub(super) fn at(&self, first: usize) -> Option<&Replicate> {
        let found = self.positions.binary_search_by_key(&first, |replicate| replicate.first);
        found.ok().map(|at| &self.positions[at])
    }
}

impl Replicate {
    fn of<N: Fn(usize) -> f64>(points: &[u32], rows: &Rows<'_, N>) -> Self {
        let (distinct, copies) = rows.distinct(points);
        // Rows without noise say everything.
        let is_exact = |&point: &usize| (rows.noise)(point) <= 0.0;
        let exact: Vec<usize> = distinct.iter().copied().filter(is_exact).collect();
        let (counted, weight): (_, &dyn Fn(usize) -> f64) = if exact.is_empty() {
            (&distinct, &|point| 1.0 / (rows.noise)(point))
        } else {
            (&exact, &|_| 1.0)
        };
        let sum_of_weights: f64 = counted.iter().map(|&point| weight(point)).sum();
        let mean = |list: &&[f64]| {
            counted.iter().map(|&point| weight(point) * list[point]).sum::<f64>() / sum_of_weights
        };
        let means: Vec<f64> = rows.lists.iter().map(mean).collect();
        let squares = |(list, mean): (&&[f64], &f64)| -> f64 {
            counted.iter().map(|&point| weight(point) * ((list[point] - mean) / rows.unit).powi(2)).sum()
        };
        let scatter = Scatter {
            squares: rows.lists.iter().zip(&means).map(squares).sum(),
            n_degrees: rows.lists.len() * (counted.len() - 1),
        };
        let (noise, scatter) =
            if exact.is_empty() { (1.0 / sum_of_weights, scatter) } else { (0.0, Scatter::default()) };
        Self { first: points[0] as usize, means, noise, scatter, copies }
    }
}

impl<N> Rows<'_, N> {
    /// Returns the rows that are no copies of earlier ones, ascending, and the copies.
    ///
    /// Values are equal if they differ by less than the least noise that is looked for.
    fn distinct(&self, points: &[u32]) -> (Vec<usize>, Vec<RowCopy>) {
        let unit = (LEAST_RATIO * self.mean_square).sqrt() * self.unit;
        let rounded = |list: &[f64], point: u32| (list[point as usize] / unit).round() + 0.0;
        let compare = |&a: &u32, &b: &u32| {
            let orders = self.lists.iter().map(|list| rounded(list, a).total_cmp(&rounded(list, b)));
            orders.fold(Ordering::Equal, Ordering::then)
        };
        let mut rows = points.to_vec();
        rows.sort_by(compare);
        let (mut distinct, mut copies) = (Vec::new(), Vec::new());
        for equal in rows.chunk_by(|a, b| compare(a, b).is_eq()) {
            let of = equal[0] as usize;
            distinct.push(of);
            copies.extend(equal[1..].iter().map(|&row| RowCopy { row: row as usize, of }));
        }
        distinct.sort_unstable();
        (distinct, copies)
    }
}
