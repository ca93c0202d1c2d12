//! Hyperparameters from the likelihood pooled over a sample of neighbourhoods.

use super::NoiseRatio;
use super::regression::{Model, ModelResult, Trend};
use crate::kernel::Family;

/// Order of Matérn's kernel: ν = 9/2. Kriged curvatures of analytic surfaces are then as far off as their
/// deviations say. With ν = 7/2 they are closer than that, with Gauss's kernel farther (docs/error-bars.md).
const ORDER: u8 = 4;

/// Length scale ℓ in units of the radius of a neighbourhood.
///
/// The radius follows the curvature, so one ratio serves surfaces of all sizes. Shorter length scales mistake
/// noise that neighbours share for shape. Longer ones promise deviations that are too small on scans
/// (docs/error-bars.md).
const LENGTH_SCALE: f64 = 1.4;

/// Length scale of the stiff models, in units of the radius, for slopes where the surface is flat and the
/// cloud has noise.
///
/// Neighbours of a scan have some of their noise in common. The likelihood takes it for shape, and the short
/// length scale takes it for slopes. The stiffer process averages it, and has no bias where there is nothing
/// but noise (docs/error-bars.md).
const STIFF: f64 = 4.0;

/// Order of Matérn's kernel where curvatures jump, as beside fillets: ν = 5/2, whose paths have no third
/// derivatives. Length scale ℓ in units of the radius of a neighbourhood.
///
/// With ν = 9/2 alone, what is within half a spacing of a jump is off by eight deviations. With a length
/// scale of 1.4 this process is too smooth as well, and with 6 its bars are as long (docs/error-bars.md).
const ROUGH_ORDER: u8 = 2;
const ROUGH_LENGTH_SCALE: f64 = 3.0;

/// Candidate ratios for this process. With more noise, nothing tells it from the smoother one. It would take
/// a third of the neighbourhoods of smooth surfaces, and make bars longer there (docs/error-bars.md).
const ROUGH_NOISES: [f64; 4] = [0.0, 1e-8, 1e-6, 1e-4];

/// Candidate ratios of the variance of the noise to that of the process.
const NOISES: [f64; 12] = [0.0, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0, 100.0];

/// Share of the neighbourhoods below which a model is dropped, and that for a trend of fourth order. Where
/// points are exact, what it leaves of single neighbourhoods looks like noise by chance. Each model takes as
/// long as the first.
const LEAST_SHARE: f64 = 0.01;
const LEAST_SHARE_OF_QUARTIC: f64 = 0.1;
/// Greatest number of models kept.
pub const MAX_MODELS: usize = 8;

/// Number of expectation-maximization steps. Shares settle to a hundredth within some fifty.
const STEPS: usize = 100;

/// A model with the logarithm of the share of neighbourhoods that it describes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WeightedModel {
    pub model: Model,
    pub log_share: f64,
}

/// What models of a mixture have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A quadric as the trend.
    Plain,
    /// The same with a rougher process, for curvatures that jump.
    Rough,
    /// The same as plain with the long length scale, [`STIFF`].
    Stiff,
    /// A trend of fourth order.
    Quartic,
}

impl Kind {
    /// Candidates among which the likelihood decides.
    pub(crate) fn candidates(self) -> Vec<Model> {
        let noises = if self == Self::Rough { &ROUGH_NOISES[..] } else { &NOISES };
        noises.iter().map(|&noise| self.model(noise)).collect()
    }

    /// The mixture with these noise ratios.
    pub(crate) fn mixture(self, ratios: &[NoiseRatio]) -> Vec<WeightedModel> {
        let of = |&NoiseRatio { ratio, log_share }: &NoiseRatio| WeightedModel {
            model: self.model(ratio),
            log_share,
        };
        ratios.iter().map(of).collect()
    }

    pub(crate) fn describes(self, model: &Model) -> bool {
        *model == self.model(model.noise)
    }

    /// The ratios of a mixture that belong to models of this kind.
    pub(crate) fn ratios(self, models: &[WeightedModel]) -> Vec<NoiseRatio> {
        let own = models.iter().filter(|of| self.describes(&of.model));
        own.map(|of| NoiseRatio { ratio: of.model.noise, log_share: of.log_share }).collect()
    }

    /// Share of the neighbourhoods below which a model is dropped.
    pub(crate) fn least_share(self) -> f64 {
        match self {
            Self::Plain | Self::Rough | Self::Stiff => LEAST_SHARE,
            Self::Quartic => LEAST_SHARE_OF_QUARTIC,
        }
    }

    fn model(self, noise: f64) -> Model {
        let (order, length_scale, trend) = match self {
            Self::Plain => (ORDER, LENGTH_SCALE, Trend::Quadric),
            Self::Rough => (ROUGH_ORDER, ROUGH_LENGTH_SCALE, Trend::Quadric),
            Self::Stiff => (ORDER, STIFF, Trend::Quadric),
            Self::Quartic => (ORDER, LENGTH_SCALE, Trend::Quartic),
        };
        Model { family: Family::Matern { order }, length_scale, noise, trend }
    }
}

/// Finds the mixture of candidates that makes a sample of neighbourhoods most likely. Those of less than a
/// share are dropped.
///
/// `log_likelihoods` is `[neighbourhoods][models]`. The shares come from expectation and maximization
/// (nonparametric maximum likelihood: Laird 1978).
pub(crate) fn pool(
    least_share: f64,
    candidates: &[Model],
    log_likelihoods: &[Vec<f64>],
) -> Vec<WeightedModel> {
    let n = candidates.len();
    let shares = mixture_shares(n, log_likelihoods);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| shares[b].total_cmp(&shares[a]));
    let kept = order.into_iter().enumerate().filter(|&(rank, at)| rank == 0 || shares[at] > least_share);
    let kept = kept.take(MAX_MODELS).map(|(_, at)| at);
    kept.map(|at| WeightedModel { model: candidates[at], log_share: shares[at].ln() }).collect()
}

/// Returns the shares of `n` components that make a sample most likely: expectation and maximization
/// (nonparametric maximum likelihood: Laird 1978). `log_likelihoods` is `[sample][n]`.
pub(super) fn mixture_shares(n: usize, log_likelihoods: &[Vec<f64>]) -> Vec<f64> {
    let mut shares = vec![1.0 / n as f64; n];
    for _ in 0..STEPS {
        let mut sums = vec![0.0; n];
        for logs in log_likelihoods {
            let weighted: Vec<f64> = logs.iter().zip(&shares).map(|(l, s)| l + s.ln()).collect();
            for (sum, responsibility) in sums.iter_mut().zip(normalized(&weighted)) {
                *sum += responsibility;
            }
        }
        let total: f64 = sums.iter().sum();
        if total == 0.0 {
            break;
        }
        shares = sums.iter().map(|sum| sum / total).collect();
    }
    shares
}

/// Returns probabilities from their logarithms up to a constant. Entries that are not finite have probability
/// 0, and all are 0 if none is finite.
pub(crate) fn normalized(logs: &[f64]) -> Vec<f64> {
    let largest = logs.iter().copied().filter(|log| log.is_finite()).fold(f64::NEG_INFINITY, f64::max);
    let mut weights: Vec<f64> =
        logs.iter().map(|log| if log.is_finite() { (log - largest).exp() } else { 0.0 }).collect();
    let total: f64 = weights.iter().sum();
    if total > 0.0 {
        weights.iter_mut().for_each(|weight| *weight /= total);
    }
    weights
}

/// Posterior probabilities of the models of one neighbourhood.
pub(crate) fn responsibilities(models: &[WeightedModel], kriged: &[ModelResult]) -> Vec<f64> {
    let logs = models.iter().zip(kriged).map(|(model, kriged)| model.log_share + kriged.log_likelihood);
    normalized(&logs.collect::<Vec<f64>>())
}
