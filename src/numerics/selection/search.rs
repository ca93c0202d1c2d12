//! The likeliest cell of a grid over smoothness, length scale, and noise.

use super::likelihood::{Score, score};
use super::sample::Sample;
use super::{Learned, Noise, Observed};
use crate::numerics::error::NumericsError;
use crate::numerics::kernel::{Family, Kernel};
use crate::numerics::observer::Observer;

/// From rough to smooth. All have second derivatives, which operators need.
const FAMILIES: [Family; 3] = [Family::Matern { order: 2 }, Family::Matern { order: 4 }, Family::Gauss];

/// By how many steps the length scale of a family is shorter than that of the one before for the same correlations.
const SHORTER: usize = 2;

/// The least length scale in spacings, and the factor from one to the next.
const LEAST_SPACINGS: f64 = 0.625;
const LENGTH_FACTOR: f64 = std::f64::consts::SQRT_2;
const N_LENGTHS: usize = 15;

/// Where the search begins: 14 spacings.
const FIRST_LENGTH: usize = 9;

/// That of a field that neighbours hardly explain: 1.25 spacings.
const ROUGH_LENGTH: usize = 2;

/// Ratios of noise to variance: the least, and quarters of a decade up to 10.
const LEAST_RATIO: f64 = 1e-10;
const RATIOS_PER_DECADE: usize = 4;
const N_RATIOS: usize = 11 * RATIOS_PER_DECADE + 1;

/// Ratios that are looked at first: every second decade.
const COARSE_RATIOS: usize = 2 * RATIOS_PER_DECADE;

/// The least ratio for every point: with less a factorization of many points does not leave a digit of a variance.
const RATIO_PER_POINT: f64 = 1e-13;

/// Noise beyond this share of the mean square of the values is unlikely from the start, by [`AGAINST_NOISE`] for the square of each decade more:
/// values that no neighbours explain are as well a field too rough for them as noise, and the bars of the rough field cover both.
const LIKELY_SHARE: f64 = 0.1;
const AGAINST_NOISE: f64 = 3.0;

/// What a step has to gain.
const GAIN: f64 = 1e-6;

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
struct Cell([usize; 3]);

impl Grid {
    pub(super) fn of(observed: &Observed<'_>) -> Self {
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

    /// What is taken where the values do not say.
    pub(super) fn undecided(&self, observed: &Observed<'_>, sample: &Sample) -> Learned {
        let family = FAMILIES[0];
        let length_scale = family.length_scale_of_values(observed.sampling.scales());
        let ratio = self.ratio(self.least_ratio);
        // With no spread to go by, the size of the values is all there is to say how much they may vary.
        let mean_square = observed.values.iter().map(|v| v * v).sum::<f64>() / observed.values.len() as f64;
        let by_values = if sample.is_zero() { 1.0 } else { in_units(1.0, mean_square.sqrt()) };
        Learned {
            family,
            length_scale,
            ratio: if self.is_exact() { 0.0 } else { ratio },
            variance: self.variance(ratio).unwrap_or(by_values),
            trend: None,
        }
    }

    fn is_exact(&self) -> bool {
        matches!(self.noise, KnownNoise::Known(0.0))
    }

    fn ratio(&self, index: usize) -> f64 {
        let ratio = LEAST_RATIO * 10f64.powf(index as f64 / RATIOS_PER_DECADE as f64);
        rounded(ratio, BITS_OF_RATIO)
    }

    /// What the ratio makes of a noise that is known.
    fn variance(&self, ratio: f64) -> Option<f64> {
        match self.noise {
            KnownNoise::Known(noise) if noise > 0.0 => Some((noise / ratio).clamp(1e-140, 1e140)),
            KnownNoise::Known(_) | KnownNoise::Unknown => None,
        }
    }

    fn length_scale(&self, index: usize) -> f64 {
        LEAST_SPACINGS * LENGTH_FACTOR.powi(index as i32) * self.spacing
    }

    /// A neighbouring cell, if there is one.
    fn moved(&self, cell: Cell, lengths: isize, ratios: isize) -> Option<Cell> {
        let [family, length, ratio] = cell.0;
        let length = length.checked_add_signed(lengths).filter(|&length| length < N_LENGTHS)?;
        let ratio = ratio.checked_add_signed(ratios).filter(|&ratio| ratio < N_RATIOS)?;
        (ratio >= self.least_ratio).then_some(Cell([family, length, ratio]))
    }
}

/// Scores of cells, as far as they were asked for.
pub(super) struct Search<'a> {
    sample: &'a Sample,
    grid: Grid,
    scores: Vec<Option<Option<Score>>>,
}

impl<'a> Search<'a> {
    pub(super) fn new(sample: &'a Sample, grid: Grid) -> Self {
        Self { sample, grid, scores: vec![None; FAMILIES.len() * N_LENGTHS * N_RATIOS] }
    }

    /// Family by family, each from where the one before ended. `None` if no kernel explains the values in float64.
    ///
    /// # Errors
    /// [`NumericsError::WeightsOverflow`] of values whose square leaves float64; [`NumericsError::Cancelled`].
    pub(super) fn run(mut self, observer: &dyn Observer) -> Result<Option<Learned>, NumericsError> {
        let mut best = self.begin(observer)?;
        let mut from = best;
        for family in 0..FAMILIES.len() {
            if family > 0 {
                let [_, length, ratio] = from.0;
                from = Cell([family, length.saturating_sub(SHORTER), ratio]);
            }
            from = self.descend(from, observer)?;
            if family == 0 && self.is_mostly_noise(from, observer)? {
                from = self.or_rough(from, observer)?;
            }
            if self.height(from, observer)? < self.height(best, observer)? {
                best = from;
            }
        }
        let Some(Score { variance, .. }) = self.score(best, observer)? else { return Ok(None) };
        let [family, length, ratio] = best.0;
        let variance =
            self.grid.variance(self.grid.ratio(ratio)).unwrap_or(in_units(variance, self.sample.unit));
        if variance > GREATEST_VARIANCE {
            return Err(NumericsError::WeightsOverflow);
        }
        let ratio = if self.grid.is_exact() { 0.0 } else { self.grid.ratio(ratio) };
        Ok(Some(Learned {
            family: FAMILIES[family],
            length_scale: self.grid.length_scale(length),
            ratio,
            variance,
            trend: None,
        }))
    }

    fn is_mostly_noise(&mut self, cell: Cell, observer: &dyn Observer) -> Result<bool, NumericsError> {
        let Some(score) = self.score(cell, observer)? else { return Ok(false) };
        Ok(self.against_noise(self.grid.ratio(cell.0[2]) * score.variance) > 0.0)
    }

    /// This, or what is found from where the values are a rough field without noise, if that is better.
    fn or_rough(&mut self, found: Cell, observer: &dyn Observer) -> Result<Cell, NumericsError> {
        let rough = Cell([found.0[0], ROUGH_LENGTH, self.grid.least_ratio]);
        let other = self.descend(rough, observer)?;
        let is_better = self.height(other, observer)? < self.height(found, observer)?;
        Ok(if is_better { other } else { found })
    }

    /// The best of some ratios far apart.
    fn begin(&mut self, observer: &dyn Observer) -> Result<Cell, NumericsError> {
        let least = self.grid.least_ratio;
        let mut best = Cell([0, FIRST_LENGTH, least]);
        if self.grid.is_exact() {
            return Ok(best);
        }
        for ratio in (least..N_RATIOS).step_by(COARSE_RATIOS) {
            let cell = Cell([0, FIRST_LENGTH, ratio]);
            if self.height(cell, observer)? < self.height(best, observer)? {
                best = cell;
            }
        }
        Ok(best)
    }

    /// Goes on in every direction that gains, with smaller and smaller steps.
    fn descend(&mut self, mut at: Cell, observer: &dyn Observer) -> Result<Cell, NumericsError> {
        for (lengths, ratios) in [(2, 4), (1, 2), (1, 1)] {
            let directions = [(0, ratios), (lengths, 0), (lengths, -ratios)];
            let mut is_moving = true;
            while is_moving {
                is_moving = false;
                for (lengths, ratios) in directions {
                    if self.grid.is_exact() && ratios != 0 {
                        continue;
                    }
                    let next = self.line(at, lengths, ratios, observer)?;
                    is_moving |= next != at;
                    at = next;
                }
            }
        }
        Ok(at)
    }

    /// As far as it gains along a direction or against it.
    fn line(
        &mut self,
        at: Cell,
        lengths: isize,
        ratios: isize,
        observer: &dyn Observer,
    ) -> Result<Cell, NumericsError> {
        let mut at = at;
        for sign in [1, -1] {
            let begin = at;
            while let Some(next) = self.grid.moved(at, sign * lengths, sign * ratios) {
                if self.height(next, observer)? >= self.height(at, observer)? - GAIN {
                    break;
                }
                at = next;
            }
            if at != begin {
                break;
            }
        }
        Ok(at)
    }

    fn height(&mut self, cell: Cell, observer: &dyn Observer) -> Result<f64, NumericsError> {
        let Some(score) = self.score(cell, observer)? else { return Ok(f64::INFINITY) };
        Ok(score.negative_log + self.against_noise(self.grid.ratio(cell.0[2]) * score.variance))
    }

    /// What noise of this variance costs beforehand.
    fn against_noise(&self, noise: f64) -> f64 {
        match self.grid.noise {
            KnownNoise::Known(_) => 0.0,
            KnownNoise::Unknown => {
                let share = noise / self.sample.least_variance;
                AGAINST_NOISE * (share / LIKELY_SHARE).log10().max(0.0).powi(2)
            }
        }
    }

    fn score(&mut self, cell: Cell, observer: &dyn Observer) -> Result<Option<Score>, NumericsError> {
        let [family, length, ratio] = cell.0;
        let slot = (family * N_LENGTHS + length) * N_RATIOS + ratio;
        if let Some(known) = self.scores[slot] {
            return Ok(known);
        }
        let ratio = self.grid.ratio(ratio);
        let found = match Kernel::new(FAMILIES[family], self.grid.length_scale(length), 1.0) {
            Ok(kernel) => {
                let unit = self.sample.unit;
                let variance = self.grid.variance(ratio).map(|v| in_units(v, 1.0 / unit));
                score(self.sample, &kernel, ratio, variance, observer)?
            }
            Err(_) => None,
        };
        self.scores[slot] = Some(found);
        Ok(found)
    }
}

/// Significant bits of ratios, and of variances: their product has all of its bits in float64, so that the noise over the variance is the
/// ratio again, to the last bit, for whoever sends both back.
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

/// A variance in other units.
fn in_units(variance: f64, unit: f64) -> f64 {
    match variance * unit * unit {
        found if found <= GREATEST_VARIANCE => rounded(found.max(LEAST_VARIANCE), BITS_OF_VARIANCE),
        _ => f64::INFINITY,
    }
}
