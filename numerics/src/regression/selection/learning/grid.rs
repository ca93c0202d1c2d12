//! A grid of kernels and noises: smoothness, length scale, and the ratio of noise to variance.

use super::values::Values;
use super::{LEAST_RATIO, LearnedModel, Noise};
use crate::error::{NumericsError, Result};
use crate::kernel::{Family, Kernel};

/// Families from rough to smooth. All have second derivatives, which operators need.
const FAMILIES: [Family; 3] = [Family::Matern { order: 2 }, Family::Matern { order: 4 }, Family::Gauss];

/// Index of the roughest of [`FAMILIES`], with which a search starts.
pub(super) const ROUGHEST: usize = 0;

/// Steps by which the length scale of a family is shorter than that of the family before, for the same
/// correlations.
const SHORTER: usize = 2;

/// Steps by which the ratio falls where the length scale grows by one step, along the ridge of the
/// likelihood. Near values determine `variance/ℓ^2ν` alone (Zhang 2004), and a step of half an octave
/// multiplies ℓ^2ν by 2^ν. For Gauss, the ridge is as steep as searches found it.
const RIDGES: [isize; 3] = [3, 5, 7];

/// Least length scale in spacings. [`LENGTH_FACTOR`] is the factor from one to the next.
const LEAST_SPACINGS: f64 = 0.625;
const LENGTH_FACTOR: f64 = std::f64::consts::SQRT_2;
const N_LENGTHS: usize = 15;

/// Index of the length scale at which a search begins: 14 spacings.
const FIRST_LENGTH: usize = 9;

/// Index of the length scale of a field that neighbours hardly explain: 1.25 spacings.
const ROUGH_LENGTH: usize = 2;

/// Index of the shortest length scale that may explain a local feature: 3.5 spacings. A shorter one explains
/// single outliers.
const LEAST_LOCAL: usize = 5;

/// Ratios of noise to variance follow [`LEAST_RATIO`] in quarters of a decade, up to 10.
const RATIOS_PER_DECADE: usize = 4;
const N_RATIOS: usize = 11 * RATIOS_PER_DECADE + 1;

/// Step between the ratios that are tried first: two decades.
const COARSE_RATIOS: usize = 2 * RATIOS_PER_DECADE;

/// Least ratio, per point of the cloud. With less, a factorization of many points does not leave a digit of a
/// variance.
const RATIO_PER_POINT: f64 = 1e-13;

/// Share of the mean square of the values above which noise is unlikely a priori. The penalty in log
/// likelihood is [`AGAINST_NOISE`] times the square of the decades above it.
///
/// Values that no neighbours explain may equally be noise or a field too rough for the points. The bars of
/// the rough field cover both.
const LIKELY_SHARE: f64 = 0.1;
const AGAINST_NOISE: f64 = 3.0;

pub(super) const N_FAMILIES: usize = FAMILIES.len();
pub(super) const N_CELLS: usize = N_FAMILIES * N_LENGTHS * N_RATIOS;

/// The grid for given values: their spacing, what is known of their noise, and the least ratio.
pub(super) struct Grid {
    spacing: f64,
    /// Scales of the columns, `[d]`, of which length scales are multiples. `None` if all columns share one.
    columns: Option<Vec<f64>>,
    noise: KnownNoise,
    least_ratio: usize,
}

enum KnownNoise {
    Unknown,
    /// Mean variance of the noise.
    Known(f64),
}

/// A cell of the grid: indices of a family, a length scale and a ratio.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cell {
    pub(super) family: usize,
    length: usize,
    ratio: usize,
}

impl Cell {
    /// Returns the index of the cell among [`N_CELLS`].
    pub(super) fn slot(self) -> usize {
        (self.family * N_LENGTHS + self.length) * N_RATIOS + self.ratio
    }
}

/// A step to another cell of the same family, in indices of length scales and ratios.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    pub(super) lengths: isize,
    pub(super) ratios: isize,
}

impl Step {
    pub(super) fn times(self, factor: isize) -> Self {
        Self { lengths: factor * self.lengths, ratios: factor * self.ratios }
    }
}

impl Grid {
    pub(super) fn of(values: &Values<'_>) -> Self {
        let observed = &values.observed;
        let noise = match observed.noise {
            Noise::Unknown => KnownNoise::Unknown,
            Noise::Uniform(alpha) => KnownNoise::Known(alpha),
            Noise::PerPoint(all) => KnownNoise::Known(all.iter().sum::<f64>() / all.len() as f64),
        };
        let least = (RATIO_PER_POINT * observed.cloud.n_points() as f64 / LEAST_RATIO).max(1.0).log10();
        let least_ratio = (least * RATIOS_PER_DECADE as f64).ceil() as usize;
        Self {
            spacing: observed.sampling.scales().spacing,
            columns: None,
            noise,
            least_ratio: least_ratio.min(N_RATIOS - 1),
        }
    }

    /// Returns the grid of kernels whose length scales are multiples of `scales`, `[d]`. `spacing` is that of
    /// the points in units of them.
    pub(super) fn of_columns(values: &Values<'_>, scales: Vec<f64>, spacing: f64) -> Self {
        Self { spacing, columns: Some(scales), ..Self::of(values) }
    }

    /// Returns the kernel and noise for values that do not determine them.
    pub(super) fn undecided(&self, values: &Values<'_>) -> LearnedModel {
        let observed = &values.observed;
        let family = FAMILIES[ROUGHEST];
        let ratio = ratio(self.least_ratio);
        // Without a spread, only the size of the values indicates how much they may vary.
        let mean_square = observed.values.iter().map(|v| v * v).sum::<f64>() / observed.values.len() as f64;
        let by_values = if values.is_zero() { 1.0 } else { in_units(1.0, mean_square.sqrt()) };
        // Rows at one position scatter by their noise, however few there are.
        let ratio = match (&self.noise, values.scattered_variance()) {
            (KnownNoise::Unknown, Some(noise)) => {
                ratio.max(noise / (mean_square.sqrt() / values.unit).powi(2))
            }
            _ => ratio,
        };
        LearnedModel {
            family,
            length_scale: family.length_scale_of_values(observed.sampling.scales()),
            length_scales: None,
            ratio: if self.is_exact() { 0.0 } else { ratio },
            variance: self.known_variance(ratio).unwrap_or(by_values),
            copies: Vec::new(),
            trend: None,
            disagreement: None,
        }
    }

    /// Returns the kernel and noise of a cell. `variance` is in units of the square of the greatest value,
    /// `unit`.
    ///
    /// # Errors
    /// [`NumericsError::WeightsOverflow`] for values whose squares exceed float64, and the errors of the
    /// kernel.
    pub(super) fn learned(&self, cell: Cell, variance: f64, unit: f64) -> Result<LearnedModel> {
        let ratio = ratio(cell.ratio);
        let variance = self.known_variance(ratio).unwrap_or(in_units(variance, unit));
        if variance > GREATEST_VARIANCE {
            return Err(NumericsError::WeightsOverflow);
        }
        let kernel = self.correlations(cell)?;
        Ok(LearnedModel {
            family: kernel.family(),
            length_scale: kernel.length_scale(),
            length_scales: kernel.length_scales().map(<[f64]>::to_vec),
            ratio: if self.is_exact() { 0.0 } else { ratio },
            variance,
            copies: Vec::new(),
            trend: None,
            disagreement: None,
        })
    }

    /// Returns the kernel of a cell with variance 1, and the ratio of its noise. `None` if float64 has no
    /// such kernel.
    pub(super) fn kernel(&self, cell: Cell) -> Option<(Kernel, f64)> {
        Some((self.correlations(cell).ok()?, ratio(cell.ratio)))
    }

    /// Returns the kernel of a cell, of variance 1.
    fn correlations(&self, cell: Cell) -> Result<Kernel> {
        let (family, length) = (FAMILIES[cell.family], self.length_scale(cell.length));
        match &self.columns {
            None => Kernel::new(family, length, 1.0),
            Some(scales) => {
                let length_scales: Vec<f64> = scales.iter().map(|scale| scale * length).collect();
                Kernel::of_axes(family, &length_scales, 1.0)
            }
        }
    }

    /// Returns the variance that known noise leaves to a cell, in units of the square of the greatest value,
    /// `unit`.
    pub(super) fn variance(&self, cell: Cell, unit: f64) -> Option<f64> {
        self.known_variance(ratio(cell.ratio)).map(|variance| in_units(variance, 1.0 / unit))
    }

    /// Returns the prior penalty on the noise of a cell in log likelihood. `variance` is that of the process,
    /// and `mean_square` that of the values. Known noise has no penalty.
    pub(super) fn against_noise(&self, cell: Cell, variance: f64, mean_square: f64) -> f64 {
        match self.noise {
            KnownNoise::Known(_) => 0.0,
            KnownNoise::Unknown => {
                let share = ratio(cell.ratio) * variance / mean_square;
                AGAINST_NOISE * (share / LIKELY_SHARE).log10().max(0.0).powi(2)
            }
        }
    }

    /// Cells at which a search starts. Their ratios are far apart.
    pub(super) fn starts(&self) -> impl Iterator<Item = Cell> + use<> {
        let n = if self.is_exact() { 1 } else { N_RATIOS };
        let ratios = (self.least_ratio..N_RATIOS).step_by(COARSE_RATIOS).take(n);
        ratios.map(|ratio| Cell { family: ROUGHEST, length: FIRST_LENGTH, ratio })
    }

    /// Returns the cell of a rough field with the least noise.
    pub(super) fn rough(&self, family: usize) -> Cell {
        Cell { family, length: ROUGH_LENGTH, ratio: self.least_ratio }
    }

    /// Returns whether the length scale of a cell is too long to turn an outlier into a feature.
    pub(super) fn is_longer_than_outliers(&self, cell: Cell) -> bool {
        cell.length >= LEAST_LOCAL
    }

    /// Returns the cell of another family with about the same correlations.
    pub(super) fn of_family(&self, cell: Cell, family: usize) -> Cell {
        let of_first = cell.length + SHORTER * cell.family;
        let length = of_first.saturating_sub(SHORTER * family).min(N_LENGTHS - 1);
        Cell { family, length, ratio: cell.ratio }
    }

    /// Returns the cell of the same family that is a step away. `None` if there is none.
    pub(super) fn moved(&self, cell: Cell, step: Step) -> Option<Cell> {
        let length = cell.length.checked_add_signed(step.lengths).filter(|&length| length < N_LENGTHS)?;
        let ratio = cell.ratio.checked_add_signed(step.ratios).filter(|&ratio| ratio < N_RATIOS)?;
        let is_free = step.ratios == 0 || !self.is_exact();
        (is_free && ratio >= self.least_ratio).then_some(Cell { length, ratio, ..cell })
    }

    fn is_exact(&self) -> bool {
        matches!(self.noise, KnownNoise::Known(0.0))
    }

    /// Returns the variance of the process for which known noise has this ratio. `None` if the noise is
    /// unknown or 0.
    fn known_variance(&self, ratio: f64) -> Option<f64> {
        match self.noise {
            KnownNoise::Known(noise) if noise > 0.0 => Some((noise / ratio).clamp(1e-140, 1e140)),
            KnownNoise::Known(_) | KnownNoise::Unknown => None,
        }
    }

    fn length_scale(&self, index: usize) -> f64 {
        LEAST_SPACINGS * LENGTH_FACTOR.powi(index as i32) * self.spacing
    }
}

/// Returns the step to a longer length scale and to the ratio at which it explains near values as well.
pub(super) fn along_ridge(family: usize, lengths: isize) -> Step {
    Step { lengths, ratios: -lengths * RIDGES[family] }
}

fn ratio(index: usize) -> f64 {
    let ratio = LEAST_RATIO * 10f64.powf(index as f64 / RATIOS_PER_DECADE as f64);
    rounded(ratio, BITS_OF_RATIO)
}

/// Significant bits of ratios. With [`BITS_OF_VARIANCE`], those of variances, the product of both is exact in
/// float64. A client that sends both back then gets the same ratio to the last bit.
const BITS_OF_RATIO: i32 = 20;
const BITS_OF_VARIANCE: i32 = 32;

/// Rounds to a number of significant bits.
fn rounded(x: f64, bits: i32) -> f64 {
    let unit = 2f64.powi(x.log2().floor() as i32 + 1 - bits);
    (x / unit).round() * unit
}

/// Greatest variance that is served. [`LEAST_VARIANCE`] replaces smaller ones, which makes bars too long
/// rather than too short.
const GREATEST_VARIANCE: f64 = 1e300;
const LEAST_VARIANCE: f64 = 1e-290;

/// Returns whether a variance is the least one, because the values were too small for their own.
pub(super) fn is_least_variance(variance: f64) -> bool {
    variance <= rounded(LEAST_VARIANCE, BITS_OF_VARIANCE)
}

/// Returns a variance in other units, at least [`LEAST_VARIANCE`]. Infinite above [`GREATEST_VARIANCE`].
fn in_units(variance: f64, unit: f64) -> f64 {
    match variance * unit * unit {
        found if found <= GREATEST_VARIANCE => rounded(found.max(LEAST_VARIANCE), BITS_OF_VARIANCE),
        _ => f64::INFINITY,
    }
}
