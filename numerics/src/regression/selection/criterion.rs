//! Criteria that model selection maximises, and the matrix with which their derivatives are contractions.
//!
//! Let A = K + N, `W = A⁻¹`, F the functions of the mean, `P = W − WF(FᵀWF)⁻¹FᵀW` and `Λ = PY`. Every score
//! is a function of `ln det A`, Λ and the diagonal of P. Since `dP = −P dA P` and `dΛ = −P dA Λ`, its
//! derivative is `Σ_ij G_ij dA_ij` with `G = sM + uwᵀ + wuᵀ`.

use std::f64::consts::TAU;

use crate::machine::vector::dot;

/// A criterion by which values Y, `[n]`, judge hyperparameters. A greater score is better.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Criterion {
    /// Log marginal likelihood `−½YᵀΛ − ½ ln det(K + N) − ½n ln 2π` (Rasmussen and Williams 2006, eq. 2.30).
    /// A mean enters with its generalised least-squares coefficients plugged in, as in
    /// [`crate::regression::function::posterior::log_marginal_likelihood`]. It is not the restricted
    /// likelihood.
    MarginalLikelihood,
    /// Sum of the log predictive densities of each value given all others, its own noise included:
    /// `Σ_i ln p(Y_i | Y_{−i}) = Σ_i ½ ln P_ii − ½Λ_i²/P_ii − ½ ln 2π` (Rasmussen and Williams 2006, eqs.
    /// 5.10–5.13). The coefficients of the mean are found without that value as well (Dubrule 1983).
    LeaveOneOut,
    /// Minus the generalised cross-validation error, `−n Σ_i ρ_iΛ_i²/(Σ_i ρ_i P_ii)²`, unit V². ρ is the
    /// noise in units of its mean.
    ///
    /// For the same noise α everywhere, the error is `n|Y − Ŷ|²/tr(I − H)²` with Ŷ = HY (Golub, Heath and
    /// Wahba 1979), since `I − H = αP`. For noise per point, it is the error of values in units of their
    /// noise. Variance and α count only by their ratio. Without noise, the score is the limit of vanishing
    /// noise.
    GeneralizedCrossValidation,
}

/// Quantities from which a score is computed.
pub(super) struct Parts<'a> {
    /// `YᵀPY`.
    pub(super) energy: f64,
    /// `ln det A`.
    pub(super) log_determinant: f64,
    /// Λ, `[n]`.
    pub(super) weights: &'a [f64],
    /// `P_ii`, `[n]`. Empty if the criterion does not need it.
    pub(super) diagonal: &'a [f64],
    /// Noise ρ in units of its mean, `[n]`.
    pub(super) relative_noise: &'a [f64],
}

/// The matrix `G = sM + uwᵀ + wuᵀ` with u = Λ. M is W or `P diag(c) P`.
pub(super) struct Sensitivity {
    /// s.
    pub(super) scale: f64,
    /// c, `[n]`, or `None` for M = W.
    pub(super) of_columns: Option<Vec<f64>>,
    /// The vector v with `w = Pv`, `[n]`. For M = W it is w itself.
    pub(super) right: Vec<f64>,
}

impl Criterion {
    /// Returns whether the score depends on `P_ii`.
    pub(super) fn needs_diagonal(self) -> bool {
        self != Self::MarginalLikelihood
    }

    /// Returns the score. Greater is better.
    pub(super) fn score(self, parts: &Parts<'_>) -> f64 {
        let n = parts.weights.len() as f64;
        match self {
            Self::MarginalLikelihood => -0.5 * (parts.energy + parts.log_determinant + n * TAU.ln()),
            Self::LeaveOneOut => parts
                .weights
                .iter()
                .zip(parts.diagonal)
                .map(|(weight, p)| 0.5 * (p.ln() - weight * weight / p - TAU.ln()))
                .sum(),
            Self::GeneralizedCrossValidation => {
                let (misfit, freedom) = misfit_and_freedom(parts);
                -n * misfit / (freedom * freedom)
            }
        }
    }

    /// Returns the matrix G with which the derivatives of the score are contractions.
    pub(super) fn sensitivity(self, parts: &Parts<'_>) -> Sensitivity {
        let (n, weights) = (parts.weights.len() as f64, parts.weights);
        let times_weights = |factor: f64, each: &[f64]| -> Vec<f64> {
            weights.iter().zip(each).map(|(weight, c)| factor * c * weight).collect()
        };
        match self {
            Self::MarginalLikelihood => {
                let right = weights.iter().map(|weight| 0.25 * weight).collect();
                Sensitivity { scale: -0.5, of_columns: None, right }
            }
            Self::LeaveOneOut => {
                let c = |(weight, p): (&f64, &f64)| (1.0 + weight * weight / p) / p;
                let inverse: Vec<f64> = parts.diagonal.iter().map(|p| 1.0 / p).collect();
                let of_columns = weights.iter().zip(parts.diagonal).map(c).collect();
                Sensitivity { scale: -0.5, of_columns: Some(of_columns), right: times_weights(0.5, &inverse) }
            }
            Self::GeneralizedCrossValidation => {
                let (misfit, freedom) = misfit_and_freedom(parts);
                let square = freedom * freedom;
                Sensitivity {
                    // This order never forms the cube of a number that may be very large or small.
                    scale: -2.0 * n * (misfit / square) / freedom,
                    of_columns: Some(parts.relative_noise.to_vec()),
                    right: times_weights(n / square, parts.relative_noise),
                }
            }
        }
    }

    /// Returns the merit and its derivative by the score. Searches maximise the merit: an increasing function
    /// of the score on the scale of a log likelihood.
    ///
    /// For cross-validation it is `−½n ln(−score)`, the log likelihood of errors of unknown size.
    pub(super) fn merit(self, score: f64, n_points: usize) -> (f64, f64) {
        match self {
            Self::MarginalLikelihood | Self::LeaveOneOut => (score, 1.0),
            Self::GeneralizedCrossValidation => {
                let (half, error) = (0.5 * n_points as f64, (-score).max(f64::MIN_POSITIVE));
                // A score of 0 leaves nothing to explain and has no slope to follow.
                let slope = if score < 0.0 { half / error } else { 0.0 };
                (-half * error.ln(), slope)
            }
        }
    }
}

/// Returns `Σρ_iΛ_i²` and `Σρ_iP_ii`.
fn misfit_and_freedom(parts: &Parts<'_>) -> (f64, f64) {
    let squares = parts.weights.iter().zip(parts.relative_noise).map(|(weight, rho)| rho * weight * weight);
    (squares.sum(), dot(parts.relative_noise, parts.diagonal))
}
