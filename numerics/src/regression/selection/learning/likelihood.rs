//! The restricted likelihood of values in groups.

use faer::Mat;
use rayon::prelude::*;

use super::LearnedModel;
use super::autocorrelation::Rings;
use super::group::{Group, Nugget, WhitenedGroup};
use super::order::{Conditional, PLACE};
use super::replicates::Scatter;
use super::values::Values;
use crate::error::{NumericsError, Result};
use crate::kernel::Kernel;
use crate::machine::vector::dot;
use crate::observer::Observer;
use crate::regression::solver::trend::{Mean, Trend, remove_mean, solve_gram};
use crate::regression::solver::{Disagreement, Outlier, Place};

/// Least ratio of noise to variance with which a mean is found.
const LEAST_RATIO_OF_MEAN: f64 = 1e-10;

/// Score of a kernel: how well it explains the values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Score {
    /// `−ln` of the restricted likelihood, up to a constant.
    pub(super) negative_log: f64,
    /// Variance of the process, in the square of the unit of the values.
    pub(super) variance: f64,
    /// Variance at which the values of every small place are likely, in the same unit.
    pub(super) of_places: f64,
}

/// A test of consecutive values, which are mostly near each other: their mean square has a bound.
///
/// The greatest values are left out, since outliers are no feature. Of standard normal numbers, the mean
/// square of the rest exceeds `most` once in 500,000 runs. Hundreds of places are tested.
struct Run {
    length: usize,
    n_left_out: usize,
    most: f64,
}

const RUNS: [Run; 2] =
    [Run { length: PLACE, n_left_out: 1, most: 2.9 }, Run { length: 2 * PLACE, n_left_out: 2, most: 2.1 }];

impl Run {
    /// Returns whether there are enough values: three quarters of a run.
    fn is_of(&self, values: &[f64]) -> bool {
        4 * values.len() >= 3 * self.length
    }

    /// Returns the squares of the values that are not left out, ascending.
    fn squares(&self, values: &[f64]) -> Vec<f64> {
        let mut squares: Vec<f64> = values.iter().map(|z| z * z).collect();
        squares.sort_unstable_by(f64::total_cmp);
        squares.truncate(values.len() - self.n_left_out);
        squares
    }

    /// Returns the mean square of the values that are not left out, over its bound.
    fn excess(&self, values: &[f64]) -> f64 {
        let squares = self.squares(values);
        squares.iter().sum::<f64>() / squares.len() as f64 / self.most
    }
}

/// Groups of values on which kernels are compared.
pub(super) struct Evidence<'a> {
    pub(super) values: &'a Values<'a>,
    groups: Vec<Group>,
    /// Points whose values are explained, group after group.
    points: Vec<usize>,
    /// Scatter of the rows at these points.
    scatter: Scatter,
}

/// Functions and values without what the groups explain of them.
struct Residuals {
    /// `[n, p + k]` column by column, group after group.
    columns: Vec<f64>,
    n_rows: usize,
    log_determinant: f64,
}

impl<'a> Evidence<'a> {
    pub(super) fn of(values: &'a Values<'a>, conditionals: &[Conditional]) -> Self {
        let groups = conditionals.par_iter().map(|group| Group::of(values, group)).collect();
        let points: Vec<usize> =
            conditionals.iter().flat_map(|group| &group.points[group.n_given..]).copied().collect();
        let scatter =
            points.iter().filter_map(|&point| values.replicate(point)).map(|rows| rows.scatter).sum();
        Self { values, groups, points, scatter }
    }

    /// Returns the score of a kernel of variance 1 with this ratio of noise. The variance of the process is
    /// the given one, or else the likeliest. `None` if a matrix is not positive definite in float64.
    ///
    /// With K the covariances, `z = L⁻¹y` without its part in the range of `L⁻¹F` and s² the variance,
    /// `negative_log` is `½|z|²/s² + ½(n − p) ln s² + ½ ln det K + ½ ln det FᵀK⁻¹F` (Rasmussen and Williams
    /// 2006, eq. 2.45; Patterson and Thompson 1971). It is summed over the lists of values, each with a mean
    /// of its own. With more than one group, `L⁻¹` is that of Vecchia's approximation (order.rs).
    ///
    /// Several rows at a position are their mean. Then r rows add to |z|² the squares of their scatter over
    /// the ratio, to n r − 1, and to `ln det K` `(r − 1) ln ratio`.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(super) fn score(
        &self,
        kernel: &Kernel,
        ratio: f64,
        variance: Option<f64>,
        observer: &dyn Observer,
    ) -> Result<Option<Score>> {
        let nugget = Nugget { ratio, least: 0.0 };
        let Some(mut left) = self.unexplained(kernel, nugget, observer)? else { return Ok(None) };
        let (n, p, n_lists) = (left.n_rows, self.n_functions(), self.values.n_lists());
        let Some(of_mean) = remove_mean(&mut left.columns, n, p) else { return Ok(None) };
        let of_scatter = self.scatter.squares / ratio;
        let energy = dot(&left.columns[p * n..], &left.columns[p * n..]) + of_scatter;
        let n_scattered = self.scatter.n_degrees;
        let degrees = (n_lists * n.saturating_sub(p) + n_scattered) as f64;
        let likeliest = || (energy / degrees).max(self.values.mean_square / (1.0 + ratio));
        let variance = variance.unwrap_or_else(likeliest);
        let of_determinants =
            n_lists as f64 * (left.log_determinant + of_mean) + n_scattered as f64 * ratio.ln();
        let negative_log = 0.5 * (energy / variance + degrees * variance.ln() + of_determinants);
        let of_places = self.variance_of_places(&left.columns[p * n..]);
        Ok(negative_log.is_finite().then_some(Score { negative_log, variance, of_places }))
    }

    /// Adds to the decided kernel and noise the mean of the values, and how the values contradict the
    /// decision. Of several lists, the mean is that of the first. `kernel` is the decided one, of variance 1.
    ///
    /// # Errors
    /// [`NumericsError::MeanNotDetermined`], [`NumericsError::Cancelled`].
    pub(super) fn concluded(
        &self,
        kernel: &Kernel,
        decided: LearnedModel,
        observer: &dyn Observer,
    ) -> Result<LearnedModel> {
        // The least noise does not make the mean worse.
        let nugget = Nugget { ratio: decided.ratio, least: LEAST_RATIO_OF_MEAN };
        match (self.unexplained(kernel, nugget, observer)?, self.values.observed.mean) {
            (None, Mean::Zero) => Ok(decided),
            (None, _) => Err(NumericsError::MeanNotDetermined),
            (Some(left), mean) => {
                let trend = (mean != Mean::Zero).then(|| self.trend(&left)).transpose()?;
                let disagreement = self.disagreement(left, decided.variance);
                Ok(LearnedModel { trend, disagreement, ..decided })
            }
        }
    }

    /// Returns the greatest excess of all runs: mean square over the bound.
    fn variance_of_places(&self, rest: &[f64]) -> f64 {
        self.runs(rest).map(|(run, _, values)| run.excess(values)).fold(0.0, f64::max)
    }

    /// Yields the runs of all groups and lists, each with its first row and its values.
    fn runs<'r>(&'r self, rest: &'r [f64]) -> impl Iterator<Item = (&'static Run, usize, &'r [f64])> {
        let of_group = |begin: usize, own: &'r [f64]| {
            let of_length = move |run: &'static Run| {
                let begins = (begin..).step_by(run.length);
                begins.zip(own.chunks(run.length)).map(move |(begin, values)| (run, begin, values))
            };
            RUNS.iter().flat_map(of_length).filter(|(run, _, values)| run.is_of(values))
        };
        let of_list = move |list: &'r [f64]| {
            let begins = self.groups.iter().scan(0, |end, group| {
                let begin = *end;
                *end += group.n_responses();
                Some(begin..*end)
            });
            begins.flat_map(move |rows| of_group(rows.start, &list[rows]))
        };
        rest.chunks_exact(self.points.len()).flat_map(of_list)
    }

    /// Returns the run that is farthest beyond its bound, if any is.
    fn place(&self, rest: &[f64], in_deviations: f64) -> Option<Place> {
        let runs = self.runs(rest).map(|run| (run.0.excess(run.2), run));
        let (excess, (run, begin, values)) = runs.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
        let largest = (0..values.len()).max_by(|&a, &b| values[a].abs().total_cmp(&values[b].abs()))?;
        let mean_square = excess * run.most * in_deviations.powi(2);
        (mean_square > run.most).then(|| Place {
            point: self.points[begin + largest],
            n_points: values.len(),
            deviations: mean_square.sqrt(),
        })
    }

    fn trend(&self, left: &Residuals) -> Result<Trend> {
        let p = self.n_functions();
        let column = |a: usize| &left.columns[a * left.n_rows..][..left.n_rows];
        let gram = Mat::from_fn(p, p, |a, b| dot(column(a), column(b)));
        let right = Mat::from_fn(p, p + 1, |a, b| {
            if b < p { f64::from(u8::from(a == b)) } else { dot(column(a), column(p)) }
        });
        let solved = solve_gram(&gram, right).ok_or(NumericsError::MeanNotDetermined)?;
        let of_column = |b: usize| solved.col(b).iter().copied();
        let unit = if self.values.unit > 0.0 { self.values.unit } else { 1.0 };
        let mut coefficients: Vec<f64> = of_column(p).map(|coefficient| coefficient * unit).collect();
        coefficients[0] += self.values.first_shared();
        let covariance = (0..p).flat_map(of_column).collect();
        Ok(Trend::found(self.values.basis.clone(), coefficients, covariance))
    }

    /// Returns how the values contradict a process of this variance. Each is measured by the deviation that
    /// the earlier ones leave it.
    fn disagreement(&self, mut left: Residuals, variance: f64) -> Option<Disagreement> {
        let (n, p) = (left.n_rows, self.n_functions());
        remove_mean(&mut left.columns, n, p)?;
        let rest = &left.columns[p * n..];
        let in_deviations = self.values.unit / variance.sqrt();
        let n_degrees = n.checked_sub(p).filter(|&n| n > 0)? * self.values.n_lists();
        let mean_square = dot(rest, rest) * in_deviations.powi(2) / n_degrees as f64;
        let (at, largest) =
            rest.iter().map(|z| z.abs()).enumerate().max_by(|(_, a), (_, b)| a.total_cmp(b))?;
        let outlier = Outlier { point: self.points[at % n], deviations: largest * in_deviations };
        let place = self.place(rest, in_deviations);
        let rings = Rings::of(&self.values.observed, &self.points);
        let autocorrelation = rings.autocorrelation(rest, n, mean_square);
        Disagreement { outlier: Some(outlier), place, autocorrelation, mean_square }.if_any(n_degrees)
    }

    fn n_functions(&self) -> usize {
        self.values.basis.n_functions()
    }

    fn unexplained(
        &self,
        kernel: &Kernel,
        nugget: Nugget,
        observer: &dyn Observer,
    ) -> Result<Option<Residuals>> {
        let whitened = |group: &Group| {
            observer.checkpoint()?;
            Ok(group.whitened(kernel, nugget))
        };
        let whitened: Result<Vec<Option<WhitenedGroup>>> = self.groups.par_iter().map(whitened).collect();
        let Some(whitened) = whitened?.into_iter().collect::<Option<Vec<WhitenedGroup>>>() else {
            return Ok(None);
        };
        let n_columns = self.n_functions() + self.values.n_lists();
        let n_rows = self.groups.iter().map(Group::n_responses).sum();
        let mut columns = Vec::with_capacity(n_rows * n_columns);
        for column in 0..n_columns {
            for (group, whitened) in self.groups.iter().zip(&whitened) {
                let r = group.n_responses();
                columns.extend_from_slice(&whitened.columns[column * r..][..r]);
            }
        }
        let log_determinant = whitened.iter().map(|group| group.log_determinant).sum();
        Ok(Some(Residuals { columns, n_rows, log_determinant }))
    }
}
