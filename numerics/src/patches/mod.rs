//! Local regression: the surface around each query as a height over its tangent plane, kriged from the
//! nearest points.
//!
//! The height is the sum of a quadric (where points are exact, a polynomial of fourth order), the entailed
//! height that its curvature implies beyond second order, a Gaussian process and noise (`regression`).
//! Hyperparameters come from the likelihood pooled over a sample of neighbourhoods (`pooled`). The size of
//! the neighbourhoods and the order of the trend are chosen along with them (`learning`). Neighbourhoods grow
//! with the noise (`means`). The posterior gives normal and curvatures with their deviations (`estimate`).
//! Everything is local: work and memory are linear in points and queries.

mod answers;
mod estimate;
mod learning;
mod level;
mod levels;
mod means;
mod neighbourhood;
mod pooled;
pub(crate) mod price;
mod regression;
mod room;
mod slopes;

use std::sync::Arc;

use super::error::NumericsError;
use super::machine::heap::vec_bytes;
use super::observer::Observer;
use super::points::cloud::Cloud;
use super::points::sampling::Sampling;
pub use learning::{MAX_COARSER, MAX_SITES};
use level::Level;
pub use levels::{Agreement, N_BIASES};
use means::Support;
use neighbourhood::n_neighbours;
use pooled::Kind;
pub use pooled::MAX_MODELS;

pub use answers::{CurvatureDeviations, PatchGeometry};

/// The greatest dimension of local regressions. In higher dimensions neighbourhoods do not determine the
/// surface well enough.
pub const MAX_LOCAL_DIMENSION: usize = 4;

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
    /// Mixture of noise ratios, at most [`MAX_MODELS`]. Empty where nothing can be regressed.
    pub noise_ratios: Vec<NoiseRatio>,
    /// Part of this mixture with a rougher process, for curvatures that jump. Its shares count with those.
    pub rough_noise_ratios: Vec<NoiseRatio>,
    /// Mixture for the slopes where the surface is flat. Empty where there is no noise.
    pub flat_noise_ratios: Vec<NoiseRatio>,
    /// Mixture for a trend of fourth order. Empty where points have noise, or a quadric is as sure.
    pub quartic_noise_ratios: Vec<NoiseRatio>,
    /// Levels of means, in ascending order of points per mean. Empty where points have no noise, or where
    /// means do not reduce the standard deviations.
    pub coarser: Vec<CoarserHyperparameters>,
    /// σ: standard deviation of the noise of the points across the surface, unit L.
    pub noise: f64,
    /// σ, or 0 where it may be bends of a coarsely sampled surface: noise that neighbourhoods do not take for
    /// a bend, unit L.
    pub bend_noise: f64,
    /// Kernel of the heights: medians over the sites.
    pub kernel: PatchKernel,
}

/// Hyperparameters of a level of means.
#[derive(Debug, Clone, PartialEq)]
pub struct CoarserHyperparameters {
    /// Most points of a mean, at least 2.
    pub points_per_mean: usize,
    /// Mixtures as for the points.
    pub noise_ratios: Vec<NoiseRatio>,
    pub flat_noise_ratios: Vec<NoiseRatio>,
    /// How far the level is off those before it.
    pub agreement: Agreement,
}

/// Local regressions of the surface that a cloud samples, d ≥ 2. They run over the points and, if the points
/// have noise, also over means of increasingly many points.
pub struct Patches {
    finest: Level,
    /// Levels of means, ascending by their points.
    coarser: Vec<Coarser>,
    noise: f64,
    kernel: PatchKernel,
}

/// A level of means, and how far it is off the levels before it.
struct Coarser {
    level: Level,
    agreement: Agreement,
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
        check_dimension(cloud.dimension())?;
        let over = |group: usize| {
            Support::of(group, cloud.clone(), sampling.clone(), observer)
                .map(|support| Level::of(support, hyperparameters.bend_noise))
        };
        let mut finest = over(1)?;
        finest.models = Kind::Plain.mixture(&hyperparameters.noise_ratios);
        finest.models.extend(Kind::Rough.mixture(&hyperparameters.rough_noise_ratios));
        finest.stiff = Kind::Stiff.mixture(&hyperparameters.flat_noise_ratios);
        finest.quartic = Kind::Quartic.mixture(&hyperparameters.quartic_noise_ratios);
        let mut coarser = Vec::with_capacity(hyperparameters.coarser.len());
        for known in &hyperparameters.coarser {
            let mut level = over(known.points_per_mean)?;
            level.models = Kind::Plain.mixture(&known.noise_ratios);
            level.stiff = Kind::Stiff.mixture(&known.flat_noise_ratios);
            coarser.push(Coarser { level, agreement: known.agreement.clone() });
        }
        Ok(Self { finest, coarser, noise: hyperparameters.noise, kernel: hyperparameters.kernel })
    }

    /// Returns what was learned, or given.
    pub fn hyperparameters(&self) -> PatchHyperparameters {
        let of_level = |Coarser { level, agreement }: &Coarser| CoarserHyperparameters {
            points_per_mean: level.support.points_per_mean(),
            noise_ratios: Kind::Plain.ratios(&level.models),
            flat_noise_ratios: Kind::Stiff.ratios(&level.stiff),
            agreement: agreement.clone(),
        };
        PatchHyperparameters {
            noise_ratios: Kind::Plain.ratios(&self.finest.models),
            rough_noise_ratios: Kind::Rough.ratios(&self.finest.models),
            flat_noise_ratios: Kind::Stiff.ratios(&self.finest.stiff),
            quartic_noise_ratios: Kind::Quartic.ratios(&self.finest.quartic),
            coarser: self.coarser.iter().map(of_level).collect(),
            noise: self.noise,
            bend_noise: self.finest.bend_noise,
            kernel: self.kernel,
        }
    }

    /// Returns the largest number of points per mean over all levels, or 1 if points are regressed without
    /// averaging.
    pub fn points_per_mean(&self) -> usize {
        self.coarser.last().map_or(1, |coarsest| coarsest.level.support.points_per_mean())
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
        let of_level = |of: &Coarser| of.level.n_bytes() + of.agreement.n_bytes();
        self.finest.n_bytes() + vec_bytes(&self.coarser) + self.coarser.iter().map(of_level).sum::<usize>()
    }
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
            assert_eq!(patches.finest.count > 0, has_answers, "d = {dimension}");
            let found = patches.at(&cloud, &|_| true, true, &Unobserved).unwrap();
            assert_eq!(found.is_known.contains(&true), has_answers, "d = {dimension}");
        }
    }
}
