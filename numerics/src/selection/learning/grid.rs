//! A grid of kernels and noises: smoothness, length scale, and the ratio of noise to variance.

use super::values::Values;
use super::{Learned, Noise};
use crate::error::NumericsError;
use crate::kernel::{Family, Kernel};

/// From rough to smooth. All have second derivatives, which operators need.
const FAMILIES: [Family; 3] = [Family::Matern { order: 2 }, Family::Matern { order: 4 }, Family::Gauss];

/// By how many steps the length scale of a family is shorter than that of the one before for the same
/// correlations.
const SHORTER: usize = 2;

/// By how many steps the ratio falls where the length scale grows by one, along the ridge of the likelihood:
/// near values tell `variance/ℓ^2ν` alone (Zhang 2004), and a step of half an octave multiplies that by a
/// ν-th power of 2. For Gauss as steep as the search found it.
const RIDGES: [isize; 3] = [3, 5, 7];

/// The least length scale in spacings, and the factor from one to the next.
const LEAST_SPACINGS: f64 = 0.625;
const LENGTH_FACTOR: f64 = std::f64::consts::SQRT_2;
const N_LENGTHS: usize = 15;

/// Where a search begins: 14 spacings.
const FIRST_LENGTH: usize = 9;

/// The length scale of a field that neighbours hardly explain: 1.25 spacings.
const ROUGH_LENGTH: usize = 2;

/// The shortest length scale that is taken for what is local: 3.5 spacings. A shorter one explains single
/// outliers.
const LEAST_LOCAL: usize = 5;

/// Ratios of noise to variance: the least, and quarters of a decade up to 10.
const LEAST_RATIO: f64 = 1e-10;
const RATIOS_PER_DECADE: usize = 4;
const N_RATIOS: usize = 11 * RATIOS_PER_DECADE + 1;

/// Ratios that are looked at first: every second decade.
const COARSE_RATIOS: usize = 2 * RATIOS_PER_DECADE;

/// The least ratio for every point: with less a factorization of many points does not leave a digit of a
/// variance.
const RATIO_PER_POINT: f64 = 1e-13;

/// Noise beyond this share of the mean square of the values is unlikely from the start, by [`AGAINST_NOISE`]
/// for the square of each decade more: values that no neighbours explain are as well a field too rough for
/// them as noise, and the bars of the rough field cover both.
const LIKELY_SHARE: f64 = 0.1;
const AGAINST_NOISE: f64 = 3.0;

pub(super) const N_FAMILIES: usize = FAMILIES.len();
pub(super) const N_CELLS: usize = N_FAMILIES * N_LENGTHS * N_RATIOS;

/// The values of the parameters, and what is known of them.
pub(super) struct Grid {
    spacing: f64,
    noise: KnownNoise,
    least_ratio: usize,
}

enum KnownNoise {
    Unknown,
    /// Its mean.
    Known(f64),
}

/// Indices of a family, a length scale and a ratio.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cell {
    pub(super) family: usize,
    length: usize,
    ratio: usize,
}

impl Cell {
    /// Its place among [`N_CELLS`].
    pub(super) fn slot(self) -> usize {
        (self.family * N_LENGTHS + self.length) * N_RATIOS + self.ratio
    }
}

/// From a cell to another of its family: so many length scales and ratios further.
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
            noise,
            least_ratio: least_ratio.min(N_RATIOS - 1),
        }
    }

    /// The kernel and noise that are taken where the values do not say.
    pub(super) fn undecided(&self, values: &Values<'_>) -> Learned {
        let observed = &values.observed;
        let family = FAMILIES[0];
        let ratio = ratio(self.least_ratio);
        // With no spread to go by, the size of the values is all there is to say how much they may vary.
        let mean_square = observed.values.iter().map(|v| v * v).sum::<f64>() / observed.values.len() as f64;
        let by_values = if values.is_zero() { 1.0 } else { in_units(1.0, mean_square.sqrt()) };
        Learned {
            family,
            length_scale: family.length_scale_of_values(observed.sampling.scales()),
            ratio: if self.is_exact() { 0.0 } else { ratio },
            variance: self.known_variance(ratio).unwrap_or(by_values),
            trend: None,
            disagreement: None,
        }
    }

    /// The kernel and noise of a cell with its variance, for values in units of the greatest.
    ///
    /// # Errors
    /// [`NumericsError::WeightsOverflow`] of values whose square leaves float64.
    pub(super) fn learned(&self, cell: Cell, variance: f64, unit: f64) -> Result<Learned, NumericsError> {
        let ratio = ratio(cell.ratio);
        let variance = self.known_variance(ratio).unwrap_or(in_units(variance, unit));
        if variance > GREATEST_VARIANCE {
            return Err(NumericsError::WeightsOverflow);
        }
        Ok(Learned {
            family: FAMILIES[cell.family],
            length_scale: self.length_scale(cell.length),
            ratio: if self.is_exact() { 0.0 } else { ratio },
            variance,
            trend: None,
            disagreement: None,
        })
    }

    /// The kernel of a cell with variance 1, and the noise for it; `None` if there is no such kernel in
    /// float64.
    pub(super) fn kernel(&self, cell: Cell) -> Option<(Kernel, f64)> {
        let kernel = Kernel::new(FAMILIES[cell.family], self.length_scale(cell.length), 1.0).ok()?;
        Some((kernel, ratio(cell.ratio)))
    }

    /// The variance that a noise that is known leaves to a cell, in units of the greatest value.
    pub(super) fn variance(&self, cell: Cell, unit: f64) -> Option<f64> {
        self.known_variance(ratio(cell.ratio)).map(|variance| in_units(variance, 1.0 / unit))
    }

    /// What the noise of a cell costs beforehand, in logarithms, its variance known, for values of a mean
    /// square.
    pub(super) fn against_noise(&self, cell: Cell, variance: f64, mean_square: f64) -> f64 {
        match self.noise {
            KnownNoise::Known(_) => 0.0,
            KnownNoise::Unknown => {
                let share = ratio(cell.ratio) * variance / mean_square;
                AGAINST_NOISE * (share / LIKELY_SHARE).log10().max(0.0).powi(2)
            }
        }
    }

    /// Where a search begins: ratios far apart.
    pub(super) fn beginnings(&self) -> impl Iterator<Item = Cell> + use<> {
        let n = if self.is_exact() { 1 } else { N_RATIOS };
        let ratios = (self.least_ratio..N_RATIOS).step_by(COARSE_RATIOS).take(n);
        ratios.map(|ratio| Cell { family: 0, length: FIRST_LENGTH, ratio })
    }

    /// A rough field without noise.
    pub(super) fn rough(&self, family: usize) -> Cell {
        Cell { family, length: ROUGH_LENGTH, ratio: self.least_ratio }
    }

    /// Whether its length scale is too long to make a feature of an outlier.
    pub(super) fn is_longer_than_outliers(&self, cell: Cell) -> bool {
        cell.length >= LEAST_LOCAL
    }

    /// The cell of another family with about the same correlations.
    pub(super) fn of_family(&self, cell: Cell, family: usize) -> Cell {
        let of_first = cell.length + SHORTER * cell.family;
        let length = of_first.saturating_sub(SHORTER * family).min(N_LENGTHS - 1);
        Cell { family, length, ratio: cell.ratio }
    }

    /// A cell of the same family, if there is one that far from it.
    pub(super) fn moved(&self, cell: Cell, step: Step) -> Option<Cell> {
        let length = cell.length.checked_add_signed(step.lengths).filter(|&length| length < N_LENGTHS)?;
        let ratio = cell.ratio.checked_add_signed(step.ratios).filter(|&ratio| ratio < N_RATIOS)?;
        let is_free = step.ratios == 0 || !self.is_exact();
        (is_free && ratio >= self.least_ratio).then_some(Cell { length, ratio, ..cell })
    }

    fn is_exact(&self) -> bool {
        matches!(self.noise, KnownNoise::Known(0.0))
    }

    /// The variance of the process that a ratio leaves to a noise that is known.
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

/// A longer length scale and the ratio that it needs to explain near values as well, for a family.
pub(super) fn along_ridge(family: usize, lengths: isize) -> Step {
    Step { lengths, ratios: -lengths * RIDGES[family] }
}

fn ratio(index: usize) -> f64 {
    let ratio = LEAST_RATIO * 10f64.powf(index as f64 / RATIOS_PER_DECADE as f64);
    rounded(ratio, BITS_OF_RATIO)
}

/// Significant bits of ratios, and of variances: their product has all of its bits in float64, so that the
/// noise over the variance is the ratio again, to the last bit, for whoever sends both back.
const BITS_OF_RATIO: i32 = 20;
const BITS_OF_VARIANCE: i32 = 32;

/// To so many significant bits.
fn rounded(x: f64, bits: i32) -> f64 {
    let unit = 2f64.powi(x.log2().floor() as i32 + 1 - bits);
    (x / unit).round() * unit
}

/// The greatest variance that is served, and the least, below which bars are too long rather than too short.
const GREATEST_VARIANCE: f64 = 1e300;
const LEAST_VARIANCE: f64 = 1e-290;

/// Whether values were too small for a variance of their size.
pub(super) fn is_least_variance(variance: f64) -> bool {
    variance <= rounded(LEAST_VARIANCE, BITS_OF_VARIANCE)
}

/// A variance in other units.
fn in_units(variance: f64, unit: f64) -> f64 {
    match variance * unit * unit {
        found if found <= GREATEST_VARIANCE => rounded(found.max(LEAST_VARIANCE), BITS_OF_VARIANCE),
        _ => f64::INFINITY,
    }
}
