//! Local regression: the surface around each query as a height over its tangent plane, kriged from the
//! nearest points.
//!
//! The height is the sum of a quadric, the entailed height that its curvature implies beyond second order, a
//! Gaussian process and noise (`regression`). Hyperparameters come from the likelihood pooled over a sample
//! of neighbourhoods (`pooled`). The size of the neighbourhoods is chosen along with them and grows with the
//! noise (`means`). The posterior gives normal and curvatures with their deviations (`estimate`). Everything
//! is local: work and memory are linear in points and queries.

mod answers;
mod estimate;
mod means;
mod neighbourhood;
mod pooled;
pub(crate) mod price;
mod regression;
mod room;

use std::sync::Arc;

use super::error::NumericsError;
use super::machine::heap::vec_bytes;
use super::observer::Observer;
use super::points::cloud::Cloud;
use super::points::sampling::{Sampling, median};
use estimate::Estimate;
use means::Support;
use neighbourhood::{Neighbourhood, n_neighbours};
pub use pooled::MAX_MODELS;
use pooled::{LENGTH_SCALE, STIFF, Weighted, candidates, pool, responsibilities, weighted};
use regression::{Kriged, Model, n_terms};
use room::{Found, Purpose};

pub use answers::{CurvatureDeviations, PatchGeometry};

/// Number of neighbourhoods whose likelihood is pooled, or fewer than twice as many.
const N_SITES: usize = 96;

/// The greatest dimension of local regressions. Beyond it neighbourhoods say too little.
pub const MAX_LOCAL_DIMENSION: usize = 4;

/// Greatest number of sites that a caller of [`Patches::learned_at`] may choose.
pub const MAX_SITES: usize = 2 * N_SITES;

/// Points per mean, tried in this order.
const GROUPS: [usize; 7] = [1, 3, 8, 24, 72, 216, 648];

/// Least number of means that a group size must leave of a cloud to be tried.
const LEAST_MEANS: usize = 60;

/// Fraction to which deviations must fall for the next larger group size to be accepted, in the median over
/// the sites. Each site is compared with itself: deviations of a scan differ between sites by far more.
const WORTH: f64 = 0.95;

/// The same for means of three instead of points. Where there is hardly anything but noise, deviations fall
/// to a fifth, and in a lens that is thinner than its points are apart to two thirds. A scan thinned to a
/// twentieth, whose shape its points just resolve, lost half of the accuracy of its curvatures to means that
/// promised deviations of three quarters.
const WORTH_OF_MEANS: f64 = 0.7;

/// A ratio of the variance of the noise to that of the heights, and how common it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseRatio {
    /// Variance of the noise of a point divided by that of the heights.
    pub ratio: f64,
    /// Natural logarithm of the share of neighbourhoods with this ratio.
    pub log_share: f64,
}

/// Hyperparameters that local regressions learn of a cloud. With them, a part of the cloud is regressed as
/// the whole is.
#[derive(Debug, Clone, PartialEq)]
pub struct PatchHyperparameters {
    /// Most points per mean that a regression sees, 1 where it sees the points themselves.
    pub points_per_mean: usize,
    /// Mixture of noise ratios, at most [`MAX_MODELS`]. Empty where nothing can be regressed.
    pub noise_ratios: Vec<NoiseRatio>,
    /// Mixture for the slopes where the surface is flat. Empty where there is no noise.
    pub flat_noise_ratios: Vec<NoiseRatio>,
    /// σ: standard deviation of the noise of the points across the surface, unit L.
    pub noise: f64,
    /// Kernel of the heights: medians over the sites.
    pub kernel: PatchKernel,
}

/// Local regressions of the surface that a cloud samples, d ≥ 2.
pub struct Patches {
    support: Support,
    models: Vec<Weighted>,
    /// Models for the slopes where the surface is flat. Empty where there is no noise.
    stiff: Vec<Weighted>,
    /// Points, or means, in a neighbourhood. Below `n_terms(d) + 2`, no query has an answer.
    count: usize,
    noise: f64,
    kernel: PatchKernel,
}

/// Hyperparameters of the covariance of the heights: medians over the sites.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PatchKernel {
    /// Length scale ℓ, unit L.
    pub length_scale: f64,
    /// Variance s², unit L².
    pub variance: f64,
}

impl Patches {
    /// Chooses group size and hyperparameters by a sample of the points that covers all spacings.
    ///
    /// # Errors
    /// [`NumericsError::DimensionTooSmall`] for d = 1, [`NumericsError::Cancelled`].
    pub fn of(
        cloud: Arc<Cloud>,
        sampling: Arc<Sampling>,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        let sites = cloud.select(&sampling.of_every_spacing(N_SITES));
        Self::learned_at(&sites, cloud, sampling, observer)
    }

    /// Chooses group size and hyperparameters by the neighbourhoods of sites `[s, d]`. Parts of a cloud that
    /// hold the same neighbourhoods of the same sites learn the same.
    ///
    /// # Errors
    /// [`NumericsError::DimensionTooSmall`] for d = 1, [`NumericsError::Cancelled`].
    pub fn learned_at(
        sites: &Cloud,
        cloud: Arc<Cloud>,
        sampling: Arc<Sampling>,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        check_dimension(cloud.dimension())?;
        let mut best: Option<(Vec<f64>, Self)> = None;
        for group in GROUPS {
            if group > 1 && cloud.n_points() / group < LEAST_MEANS {
                break;
            }
            let support = Support::of(group, cloud.clone(), sampling.clone(), observer)?;
            let (deviations, patches) = Self::over(sites, support, observer)?;
            let is_exact = patches.noise == 0.0;
            let worth = if best.as_ref().is_some_and(|(_, best)| best.points_per_mean() == 1) {
                WORTH_OF_MEANS
            } else {
                WORTH
            };
            let is_better = best.as_ref().is_none_or(|(least, _)| ratio(&deviations, least) < worth);
            if is_better {
                best = Some((deviations, patches));
            }
            if !is_better || is_exact {
                break;
            }
        }
        best.map(|(_, patches)| patches).ok_or(NumericsError::EmptyCloud)
    }

    /// Regresses with hyperparameters that were learned before, of this cloud or of one that it is part of.
    ///
    /// # Errors
    /// [`NumericsError::DimensionTooSmall`] for d = 1, [`NumericsError::Cancelled`].
    pub fn with(
        hyperparameters: &PatchHyperparameters,
        cloud: Arc<Cloud>,
        sampling: Arc<Sampling>,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        let d = cloud.dimension();
        check_dimension(d)?;
        let support = Support::of(hyperparameters.points_per_mean, cloud, sampling, observer)?;
        Ok(Self {
            count: n_neighbours(d, support.cloud().n_points()),
            support,
            models: weighted(&hyperparameters.noise_ratios, LENGTH_SCALE, d),
            stiff: weighted(&hyperparameters.flat_noise_ratios, STIFF, d),
            noise: hyperparameters.noise,
            kernel: hyperparameters.kernel,
        })
    }

    /// Returns what was learned, or given.
    pub fn hyperparameters(&self) -> PatchHyperparameters {
        let ratios = |models: &[Weighted]| {
            let ratio = |of: &Weighted| NoiseRatio { ratio: of.model.noise, log_share: of.log_share };
            models.iter().map(ratio).collect()
        };
        PatchHyperparameters {
            points_per_mean: self.points_per_mean(),
            noise_ratios: ratios(&self.models),
            flat_noise_ratios: ratios(&self.stiff),
            noise: self.noise,
            kernel: self.kernel,
        }
    }

    /// Learns the hyperparameters on one support. Also returns the largest deviation of a principal curvature
    /// at each site, infinite where there is none, which [`Patches::learned_at`] compares between group
    /// sizes.
    fn over(
        sites: &Cloud,
        support: Support,
        observer: &dyn Observer,
    ) -> Result<(Vec<f64>, Self), NumericsError> {
        let d = sites.dimension();
        let count = n_neighbours(d, support.cloud().n_points());
        let mut patches = Self {
            support,
            models: Vec::new(),
            stiff: Vec::new(),
            count,
            noise: 0.0,
            kernel: PatchKernel::default(),
        };
        if count < n_terms(d) + 2 {
            return Ok((vec![f64::INFINITY; sites.n_points()], patches));
        }
        patches.models = patches.pooled(LENGTH_SCALE, sites, observer)?;
        let chosen: Vec<Model> = patches.models.iter().map(|weighted| weighted.model).collect();
        let whole = patches.krige_each(sites, &chosen, Purpose::Prediction, observer)?;
        let summary =
            |found: &Option<Found>| found.as_ref().and_then(|(at, kriged)| patches.summary(at, kriged, d));
        let estimates: Vec<Option<(f64, f64, f64, f64)>> = whole.iter().map(summary).collect();
        let middle =
            |of: fn(&(f64, f64, f64, f64)) -> f64| median(estimates.iter().flatten().map(of).collect());
        let deviations = estimates.iter().map(|e| e.map_or(f64::INFINITY, |e| e.0)).collect();
        patches.noise = middle(|e| e.1).unwrap_or(0.0).sqrt();
        patches.kernel = PatchKernel {
            length_scale: middle(|e| e.2).unwrap_or(1.0),
            variance: middle(|e| e.3).unwrap_or(1.0),
        };
        if patches.noise > 0.0 {
            patches.stiff = patches.pooled(STIFF, sites, observer)?;
        }
        Ok((deviations, patches))
    }

    /// Returns the mixture of models of one length scale that makes the neighbourhoods of these queries most
    /// likely.
    fn pooled(
        &self,
        length_scale: f64,
        queries: &Cloud,
        observer: &dyn Observer,
    ) -> Result<Vec<Weighted>, NumericsError> {
        let candidates = candidates(n_terms(queries.dimension()), length_scale);
        let found = self.krige_each(queries, &candidates, Purpose::Likelihood, observer)?;
        let logs = |(_, kriged): &Found| kriged.iter().map(|k| k.log_likelihood).collect();
        Ok(pool(&candidates, &found.iter().flatten().map(logs).collect::<Vec<Vec<f64>>>()))
    }

    /// Returns the largest deviation of a principal curvature (1/L), the variance of the noise (L²), ℓ (L)
    /// and s² (L²) of one neighbourhood.
    fn summary(&self, at: &Neighbourhood, kriged: &[Kriged], d: usize) -> Option<(f64, f64, f64, f64)> {
        let estimate = Estimate::of(&self.models, kriged, d)?;
        let deviations = estimate.curvatures(d, true).principal;
        let shares = responsibilities(&self.models, kriged);
        let (mut length_scale, mut variance, mut noise) = (0.0, 0.0, 0.0);
        for ((share, kriged), weighted) in
            shares.iter().zip(kriged).zip(&self.models).filter(|((s, _), _)| **s > 0.0)
        {
            length_scale += share * weighted.model.length_scale * at.radius;
            variance += share * kriged.scale * at.radius.powi(2);
            // Noise ratios up to 1e-7 are rounding and count as no noise.
            noise +=
                share * if weighted.model.noise > 1e-7 { kriged.scale * weighted.model.noise } else { 0.0 };
        }
        Some((
            deviations.iter().copied().fold(0.0, f64::max) / at.radius,
            noise * at.radius.powi(2),
            length_scale,
            variance,
        ))
    }

    /// Returns the most points of which regressions see the mean, 1 where they see the points themselves.
    pub fn points_per_mean(&self) -> usize {
        self.support.points_per_mean()
    }

    /// σ: standard deviation of the noise of the points across the surface, unit L.
    pub fn noise(&self) -> f64 {
        self.noise
    }

    /// Hyperparameters of the covariance of the heights: medians over the sites.
    pub fn kernel(&self) -> PatchKernel {
        self.kernel
    }

    /// Bytes held on the heap besides the cloud and its sampling.
    pub fn n_bytes(&self) -> usize {
        self.support.n_bytes() + vec_bytes(&self.models) + vec_bytes(&self.stiff)
    }
}

/// Median ratio of deviations at the same sites, infinite where none is finite.
fn ratio(deviations: &[f64], others: &[f64]) -> f64 {
    let ratios = deviations.iter().zip(others).map(|(a, b)| a / b);
    median(ratios.filter(|ratio| !ratio.is_nan()).collect()).unwrap_or(f64::INFINITY)
}

/// Returns the most points, or means, that a regression sees.
pub(crate) fn n_regressed(dimension: usize) -> usize {
    n_neighbours(dimension, usize::MAX)
}

fn check_dimension(dimension: usize) -> Result<(), NumericsError> {
    if dimension < 2 { Err(NumericsError::DimensionTooSmall { found: dimension }) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::random::Random;
    use crate::machine::vector::norm;
    use crate::observer::Unobserved;

    #[test]
    fn dimensions_without_regressions_take_no_neighbours_and_have_no_answers() {
        for (dimension, has_answers) in [(4, true), (5, false), (8, false)] {
            let mut raw = vec![0.0; 150 * dimension];
            Random::of(5, 0).fill_normal(&mut raw);
            let on_sphere = raw.chunks(dimension).flat_map(|x| x.iter().map(|c| c / norm(x)));
            let cloud = Arc::new(Cloud::new(on_sphere.collect(), dimension).unwrap());
            let sampling = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
            let patches = Patches::of(cloud.clone(), sampling, &Unobserved).unwrap();
            assert_eq!(patches.count > 0, has_answers, "d = {dimension}");
            let found = patches.at(&cloud, true, true, &Unobserved).unwrap();
            assert_eq!(found.is_known.contains(&true), has_answers, "d = {dimension}");
        }
    }
}
