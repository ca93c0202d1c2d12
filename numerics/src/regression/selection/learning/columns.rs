//! A length scale for each column of a table.
//!
//! Rows of a table have columns in different units, of which some do not matter. One length scale for all of
//! them cannot suit. Three measures of nearness are compared, each with a grid of its own: columns as they
//! are, columns in units of their spread, and columns in units of length scales that a descent finds on a
//! sample. What is more complicated has to be clearly likelier.
//!
//! Points in up to three dimensions with spreads alike are places, where all directions are alike. There,
//! what is learned does not change when the points are rotated.

use super::agreement::CellChoice;
use super::comparison::Comparison;
use super::values::Values;
use super::{LEAST_VALUES, Noise, Outcome};
use crate::error::{NumericsError, Result};
use crate::machine::random::mixed;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::regression::selection::criterion::Criterion;
use crate::regression::selection::parameters::{Hyperparameters, Parameter, Variation};
use crate::regression::selection::prior::ScalePrior;
use crate::regression::selection::search::{Selection, search};
use crate::regression::selection::subject::Observations;
use crate::regression::sums::regularization::Regularization;

/// Largest numbers of rows and of columns of a table. More take too long beside a fit, and rows that are more
/// determine which columns matter: model selection on a sample of them finds their scales.
const MAX_ROWS: usize = 2000;
const MAX_COLUMNS: usize = 16;

/// Number of rows that each column needs beside the least number of values. With four, a table of six columns
/// had bars that cover 85 %.
const ROWS_PER_COLUMN: usize = 5;

/// Largest dimension of places.
const MAX_PLACE_DIMENSION: usize = 3;

/// Least ratio of the spreads of two columns that have different units.
const UNITS: f64 = 10.0;

/// Largest number of rows on which a descent finds length scales, and number for each column up to that.
pub(super) const MAX_SAMPLE: usize = 320;
const SAMPLE_PER_COLUMN: usize = 64;

/// Largest number of evaluations of a descent.
pub(super) const MAX_EVALUATIONS: usize = 80;

/// Least gain in log likelihood, in nats, for which columns are measured in units of their spread. And that
/// for each further length scale: on the sample, where it decides whether the scales are tried, and on all
/// values.
const GAIN_OF_UNITS: f64 = 3.0;
const GAIN_ON_SAMPLE: f64 = 1.0;
const GAIN_OF_SCALE: f64 = 3.0;

/// Bounds of length scales in spreads of their columns, and factors from the start to the bounds of variance
/// and noise.
const LENGTHS: [f64; 2] = [1e-2, 1e3];
const VARIANCES: f64 = 1e3;
const LEAST_NOISE: f64 = 1e-8;
const MOST_NOISE: f64 = 10.0;

/// Returns whether a cloud is a table, for whose columns [`super::learn`] tries a length scale each.
///
/// It has 2 to 16 columns, at most 2,000 rows, and at least 8 rows and 5 more for each column. Up to three
/// columns with spreads alike are the coordinates of places.
pub fn is_table(cloud: &Cloud) -> bool {
    let (n, d) = (cloud.n_points(), cloud.dimension());
    let is_affordable =
        n <= MAX_ROWS && (2..=MAX_COLUMNS).contains(&d) && n >= LEAST_VALUES + ROWS_PER_COLUMN * d;
    is_affordable && (d > MAX_PLACE_DIMENSION || units_differ(&widths(cloud)))
}

/// Decides for one length scale for all columns.
///
/// # Errors
/// Returns the errors of [`decided`].
pub(super) fn decided_alike<'a>(values: &'a Values<'a>, observer: &dyn Observer) -> Result<Outcome<'a>> {
    let alike = Comparison::of(values, observer)?;
    let decided = alike.decided(observer)?;
    Ok((alike, decided))
}

/// Decides between one length scale for all columns of a table and one for each.
///
/// # Errors
/// `NumericsError::Cancelled`. `NumericsError::WeightsOverflow` for values whose squares exceed float64.
pub(super) fn decided<'a>(values: &'a Values<'a>, observer: &dyn Observer) -> Result<Outcome<'a>> {
    let (comparison, decided) = decided_alike(values, observer)?;
    let (mut best, table) = (Best { values, comparison, decided }, Table::of(values));
    if units_differ(&widths(values.observed.cloud)) {
        let units = Measure { scales: table.units(), least_gain: GAIN_OF_UNITS, n_learned: 0 };
        best = best.or(&units, observer)?;
    }
    let scales = match &best.decided {
        Some(decided) => table.scales(decided, observer)?,
        None => None,
    };
    if let Some(scales) = scales {
        let n_learned = table.varying().count();
        let least_gain = GAIN_OF_SCALE * table.n_further();
        best = best.or(&Measure { scales, least_gain, n_learned }, observer)?;
    }
    Ok((best.comparison, best.decided))
}

/// A measure of nearness that is tried.
struct Measure {
    /// Scales of the columns, `[d]`.
    scales: Vec<f64>,
    /// Least gain in log likelihood for which it is taken, in nats.
    least_gain: f64,
    /// Number of scales that were learned from the values.
    n_learned: usize,
}

/// The best measure of nearness so far.
struct Best<'a> {
    values: &'a Values<'a>,
    comparison: Comparison<'a>,
    decided: Option<CellChoice>,
}

impl Best<'_> {
    /// Returns what columns in units of these scales decide if that gains enough, or else itself.
    fn or(self, measure: &Measure, observer: &dyn Observer) -> Result<Self> {
        let comparison = Comparison::of_columns(self.values, &measure.scales, observer)?;
        let Some(mut decided) = comparison.decided(observer)? else { return Ok(self) };
        let before = self.decided.as_ref().map_or(f64::INFINITY, |best| best.negative_log);
        if before - decided.negative_log < measure.least_gain {
            return Ok(self);
        }
        decided.learned.variance *= self.of_few_rows(measure.n_learned);
        Ok(Self { comparison, decided: Some(decided), ..self })
    }

    /// Returns by how much n rows that also found these scales make the variance too small: `n/(n − k)`, as
    /// a fit with k parameters does. 1 where the noise is known, and the variance with it.
    fn of_few_rows(&self, n_learned: usize) -> f64 {
        let n = self.values.observed.cloud.n_points();
        match self.values.observed.noise {
            Noise::Unknown => n as f64 / (n - n_learned) as f64,
            Noise::Uniform(_) | Noise::PerPoint(_) => 1.0,
        }
    }
}

/// Rows of values, and the spreads of the columns.
struct Table<'a> {
    values: &'a Values<'a>,
    /// Standard deviation of each column, `[d]`. 0 for one that does not vary.
    spreads: Vec<f64>,
}

impl<'a> Table<'a> {
    fn of(values: &'a Values<'a>) -> Self {
        let cloud = values.observed.cloud;
        let n = cloud.n_points() as f64;
        let spread = |(column, width): (usize, f64)| {
            // In units of the width, so that no square leaves float64.
            let first = cloud.point(0)[column];
            let offset = |x: &[f64]| if width > 0.0 { (x[column] - first) / width } else { 0.0 };
            let mean = cloud.points().map(offset).sum::<f64>() / n;
            let square = cloud.points().map(|x| (offset(x) - mean).powi(2)).sum::<f64>() / n;
            width * square.sqrt()
        };
        let spreads = widths(cloud).into_iter().enumerate().map(spread).collect();
        Self { values, spreads }
    }

    /// Columns that vary.
    fn varying(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.spreads.len()).filter(|&column| self.spreads[column] > 0.0)
    }

    /// Number of columns that vary beside the first, as a float.
    fn n_further(&self) -> f64 {
        self.varying().count().saturating_sub(1) as f64
    }

    /// Returns the spreads of all columns as scales, `[d]`.
    fn units(&self) -> Vec<f64> {
        self.filled(self.spreads.clone())
    }

    /// Returns scales with one for the columns that do not vary, about which nothing is known: the shortest
    /// of the others.
    fn filled(&self, mut scales: Vec<f64>) -> Vec<f64> {
        let shortest = self.varying().map(|column| scales[column]).reduce(f64::min).unwrap_or(1.0);
        let is_constant = |column: usize| self.spreads[column] == 0.0;
        (0..scales.len()).filter(|&column| is_constant(column)).for_each(|column| scales[column] = shortest);
        scales
    }

    /// Finds length scales of all columns, `[d]`, from what is best so far. `None` if a sample does not
    /// prefer them.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    fn scales(&self, from: &CellChoice, observer: &dyn Observer) -> Result<Option<Vec<f64>>> {
        let sample = self.sample();
        let units = self.units();
        let cloud = self.values.observed.cloud.select(&sample);
        let cloud = cloud.stretched(&units.iter().map(|unit| 1.0 / unit).collect::<Vec<f64>>());
        let values: Vec<f64> = sample.iter().map(|&first| self.values.at(0, first)).collect();
        let Some(start) = self.start(from, &sample, &units) else { return Ok(None) };
        let vary = self.variations(&start);
        let asked = Selection {
            observations: Observations { cloud: &cloud, values: &values, mean: self.values.observed.mean },
            criterion: Criterion::MarginalLikelihood,
            start: &start,
            vary: &[],
            prior: ScalePrior::JointlyRobust,
            families: &[],
            restarts: 0,
            seed: 0,
            max_evaluations: MAX_EVALUATIONS,
        };
        let scored = |vary: &[Variation]| match search(&Selection { vary, ..asked }, observer) {
            Err(NumericsError::Cancelled) => Err(NumericsError::Cancelled),
            // A start that cannot be scored leaves nothing to begin with.
            found => Ok(found.ok()),
        };
        let (Some(before), Some(found)) = (scored(&[])?, scored(&vary)?) else { return Ok(None) };
        let least = GAIN_ON_SAMPLE * self.n_further();
        let length_scales = found.hyperparameters.length_scales.iter().zip(&units);
        let scales = length_scales.map(|(length_scale, unit)| length_scale * unit).collect();
        Ok((found.score - before.score >= least).then(|| self.filled(scales)))
    }

    /// Returns the first points of some positions, in an order that has nothing to do with that of the rows.
    fn sample(&self) -> Vec<usize> {
        let neighbours = self.values.observed.sampling.neighbours();
        let first = |position: usize| neighbours.points_at(position)[0];
        let mut firsts: Vec<u32> = (0..neighbours.n_positions()).map(first).collect();
        firsts.sort_unstable_by_key(|&point| mixed(u64::from(point) + 1));
        firsts.truncate(MAX_SAMPLE.min(SAMPLE_PER_COLUMN * self.spreads.len()));
        firsts.into_iter().map(|point| point as usize).collect()
    }

    /// Returns kernel and noise of what is best so far, for points in these units and values in theirs.
    /// `None` for a kernel beyond float64.
    fn start(&self, from: &CellChoice, sample: &[usize], units: &[f64]) -> Option<Hyperparameters> {
        let CellChoice { learned, .. } = from;
        let kernel = learned.kernel(1.0).ok()?;
        let of_column = |(column, unit): (usize, &f64)| {
            let length_scale = kernel.length_scales().map_or(kernel.length_scale(), |all| all[column]);
            (length_scale / unit).clamp(LENGTHS[0], LENGTHS[1])
        };
        let variance = (learned.variance.sqrt() / self.values.unit).powi(2).clamp(1e-6, 1e6);
        let noise = learned.ratio * variance;
        let noise = match (self.values.observed.noise, self.values.relative_noise(sample)) {
            (Noise::PerPoint(_), Some(relative)) => {
                Regularization::PerPoint(relative.iter().map(|each| noise * each).collect())
            }
            _ => Regularization::Uniform(noise),
        };
        let length_scales = units.iter().enumerate().map(of_column).collect();
        Some(Hyperparameters { family: learned.family, length_scales, variance, noise })
    }

    /// Returns the free parameters of the descent: a length scale for each column that varies, the variance,
    /// and the noise if it is unknown.
    fn variations(&self, start: &Hyperparameters) -> Vec<Variation> {
        let of_column = |column| Variation {
            parameter: Parameter::LengthScaleOfAxis(column),
            min: LENGTHS[0],
            max: LENGTHS[1],
        };
        let about = |parameter, min: f64, max: f64| Variation {
            parameter,
            min: min * start.variance,
            max: max * start.variance,
        };
        let mut vary: Vec<Variation> = self.varying().map(of_column).collect();
        vary.push(about(Parameter::Variance, 1.0 / VARIANCES, VARIANCES));
        if self.values.observed.noise == Noise::Unknown {
            vary.push(about(Parameter::Alpha, LEAST_NOISE, MOST_NOISE));
        }
        vary
    }
}

/// Widths of a cloud along its axes, `[d]`.
fn widths(cloud: &Cloud) -> Vec<f64> {
    let (min, max) = cloud.bounding_box();
    min.iter().zip(&max).map(|(min, max)| max - min).collect()
}

/// Returns whether the widths of two columns that vary differ by as much as units do.
fn units_differ(widths: &[f64]) -> bool {
    let varying = || widths.iter().copied().filter(|width| *width > 0.0);
    let least = varying().fold(f64::INFINITY, f64::min);
    varying().fold(0.0, f64::max) > UNITS * least
}
