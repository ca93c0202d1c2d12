//! Hyperparameters from the likelihood pooled over a sample of neighbourhoods.

use super::regression::{Kriged, Model};
use crate::kernel::Family;

/// ν = 9/2: kriged curvatures of analytic surfaces are as far off as their deviations say. With ν = 7/2 they are closer than that, with
/// Gauss's kernel farther (docs/error-bars.md).
const ORDER: u8 = 4;

/// ℓ in units of the radius of a neighbourhood. Its size follows the curvature, so that this is one for all scales; shorter ones take noise
/// that neighbours share for shape, longer ones promise more of a scan than they keep (docs/error-bars.md).
pub(crate) const LENGTH_SCALE: f64 = 1.4;

/// The same for slopes where the surface is flat and the cloud has noise. Neighbours of a scan have some of their noise in common, which
/// the likelihood takes for shape and the short scale for slopes; the stiffer process averages it, and where there is nothing but noise,
/// its bias is none (docs/error-bars.md).
pub(crate) const STIFF: f64 = 4.0;

/// Variances of the noise over that of the process.
const NOISES: [f64; 12] = [0.0, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0, 100.0];

/// Share of the neighbourhoods below which a model is left out, and models that are kept at most.
const LEAST_SHARE: f64 = 0.01;
const MAX_MODELS: usize = 6;

/// Steps of expectation and maximization: shares settle to a hundredth within some fifty.
const STEPS: usize = 100;

/// A model with the logarithm of the share of neighbourhoods that it describes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Weighted {
    pub model: Model,
    pub log_share: f64,
}

/// The models of one length scale among which the likelihood decides.
pub(crate) fn candidates(n_trend: usize, length_scale: f64) -> Vec<Model> {
    let family = Family::Matern { order: ORDER };
    let of = |noise: f64| Model { family, length_scale, noise, n_trend };
    NOISES.map(of).to_vec()
}

/// Shares of the models among neighbourhoods with these log likelihoods, `[neighbourhoods][models]`: the mixture that makes the sample
/// most likely, by expectation and maximization (nonparametric maximum likelihood: Laird 1978).
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

/// Probabilities from their logarithms up to a constant; what is not finite has none, and all are 0 if none is.
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
