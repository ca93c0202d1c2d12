//! Hyperparameters from the likelihood pooled over a sample of neighbourhoods.

use super::NoiseRatio;
use super::regression::{Kriged, Model, n_terms};
use crate::kernel::Family;

/// Order of Matérn's kernel: ν = 9/2. Kriged curvatures of analytic surfaces are then as far off as their
/// deviations say. With ν = 7/2 they are closer than that, with Gauss's kernel farther (docs/error-bars.md).
const ORDER: u8 = 4;

/// Length scale ℓ in units of the radius of a neighbourhood.
///
/// The radius follows the curvature, so one ratio serves surfaces of all sizes. Shorter length scales mistake
/// noise that neighbours share for shape. Longer ones promise deviations that are too small on scans
/// (docs/error-bars.md).
pub(crate) const LENGTH_SCALE: f64 = 1.4;

/// Length scale of the stiff models, in units of the radius, for slopes where the surface is flat and the
/// cloud has noise.
///
/// Neighbours of a scan have some of their noise in common. The likelihood takes it for shape, and the short
/// length scale takes it for slopes. The stiffer process averages it, and has no bias where there is nothing
/// but noise (docs/error-bars.md).
pub(crate) const STIFF: f64 = 4.0;

/// Candidate ratios of the variance of the noise to that of the process.
const NOISES: [f64; 12] = [0.0, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0, 100.0];

/// Share of the neighbourhoods below which a model is dropped.
const LEAST_SHARE: f64 = 0.01;
/// Greatest number of models kept.
pub const MAX_MODELS: usize = 6;

/// Number of expectation-maximization steps. Shares settle to a hundredth within some fifty.
const STEPS: usize = 100;

/// A model with the logarithm of the share of neighbourhoods that it describes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Weighted {
    pub model: Model,
    pub log_share: f64,
}

/// Candidate models of one length scale, among which the likelihood decides.
pub(crate) fn candidates(n_trend: usize, length_scale: f64) -> Vec<Model> {
    NOISES.map(|noise| model(noise, length_scale, n_trend)).to_vec()
}

/// The mixture of models with these noise ratios, for regressions in a dimension.
pub(crate) fn weighted(ratios: &[NoiseRatio], length_scale: f64, dimension: usize) -> Vec<Weighted> {
    let of = |&NoiseRatio { ratio, log_share }: &NoiseRatio| Weighted {
        model: model(ratio, length_scale, n_terms(dimension)),
        log_share,
    };
    ratios.iter().map(of).collect()
}

fn model(noise: f64, length_scale: f64, n_trend: usize) -> Model {
    Model { family: Family::Matern { order: ORDER }, length_scale, noise, n_trend }
}

/// Finds the mixture of the candidates that makes a sample of neighbourhoods most likely.
///
/// `log_likelihoods` is `[neighbourhoods][models]`. The shares come from expectation and maximization
/// (nonparametric maximum likelihood: Laird 1978).
pub(crate) fn pool(candidates: &[Model], log_likelihoods: &[Vec<f64>]) -> Vec<Weighted> {
    let n = candidates.len();
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
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| shares[b].total_cmp(&shares[a]));
    let kept = order.into_iter().enumerate().filter(|&(rank, at)| rank == 0 || shares[at] > LEAST_SHARE);
    let kept = kept.take(MAX_MODELS).map(|(_, at)| at);
    kept.map(|at| Weighted { model: candidates[at], log_share: shares[at].ln() }).collect()
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
pub(crate) fn responsibilities(models: &[Weighted], kriged: &[Kriged]) -> Vec<f64> {
    let logs = models.iter().zip(kriged).map(|(model, kriged)| model.log_share + kriged.log_likelihood);
    normalized(&logs.collect::<Vec<f64>>())
}
