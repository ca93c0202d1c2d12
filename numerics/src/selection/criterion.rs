//! What is made as great as possible, and which symmetric matrix its slopes are contractions with.
//!
//! With A = K + N, `W = A⁻¹`, F the functions of the mean, `P = W − WF(FᵀWF)⁻¹FᵀW` and `Λ = PY`, every score is a function of `ln det A`,
//! Λ and the diagonal of P, and `dP = −P dA P`, `dΛ = −P dA Λ`. So its slope is `Σ_ij G_ij dA_ij` with `G = sM + uwᵀ + wuᵀ`.

use std::f64::consts::TAU;

use crate::machine::vector::dot;

/// How hyperparameters are judged by values Y, `[n]`. Greater is better for all of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Criterion {
    /// `−½YᵀΛ − ½ ln det(K + N) − ½n ln 2π` (Rasmussen and Williams 2006, eq. 2.30). Where there is a mean, it is the one that generalised least
    /// squares find, plugged in, as [`crate::function::posterior::log_marginal_likelihood`] has it; not the restricted likelihood.
    MarginalLikelihood,
    /// `Σ_i ln p(Y_i | Y_{−i}) = Σ_i ½ ln P_ii − ½Λ_i²/P_ii − ½ ln 2π`: log densities of each value, its own noise included, given all others
    /// (Rasmussen and Williams 2006, eqs. 5.10–5.13), the coefficients of the mean found without it as well (Dubrule 1983).
    LeaveOneOut,
    /// Minus `n Σ_i ρ_iΛ_i²/(Σ_i ρ_i P_ii)²`, ρ the noise in units of its mean; unit V². With the same noise α everywhere that is
    /// `n|Y − Ŷ|²/tr(I − H)²` with Ŷ = HY (Golub, Heath and Wahba 1979), since `I − H = αP`; with noise per point it is the same of values in units of
    /// their noise. Variance and α only count by their ratio. Without noise the limit of vanishing noise.
    GeneralizedCrossValidation,
}

/// What a score is made of.
pub(super) struct Parts<'a> {
    /// `YᵀPY`.
    pub(super) energy: f64,
    /// `ln det A`.
    pub(super) log_determinant: f64,
    /// Λ, `[n]`.
    pub(super) weights: &'a [f64],
    /// `P_ii`, `[n]`; empty where it does not count.
    pub(super) diagonal: &'a [f64],
    /// ρ, `[n]`.
    pub(super) relative_noise: &'a [f64],
}

/// `G = sM + uwᵀ + wuᵀ` with u = Λ: M is W, or `P diag(c) P`.
pub(super) struct Sensitivity {
    /// s.
    pub(super) scale: f64,
    /// c, `[n]`; `None` for M = W.
    pub(super) of_columns: Option<Vec<f64>>,
    /// What w is `P` times of, `[n]`; of M = W it is w itself.
    pub(super) right: Vec<f64>,
}

impl Criterion {
    /// Whether `P_ii` is needed.
    pub(super) fn needs_diagonal(self) -> bool {
        self != Self::MarginalLikelihood
    }

    /// The score.
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

    /// What its slopes are made of.
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
                    // In this order the cube of what may be very large or small is never there.
                    scale: -2.0 * n * (misfit / square) / freedom,
                    of_columns: Some(parts.relative_noise.to_vec()),
                    right: times_weights(n / square, parts.relative_noise),
                }
            }
        }
    }

    /// An increasing function of the score that is as large as a log likelihood, and its slope: what is searched. For cross-validation
    /// `−½n ln(−score)`, the likelihood of errors whose size is not known.
    pub(super) fn merit(self, score: f64, n_points: usize) -> (f64, f64) {
        match self {
            Self::MarginalLikelihood | Self::LeaveOneOut => (score, 1.0),
            Self::GeneralizedCrossValidation => {
                let (half, error) = (0.5 * n_points as f64, (-score).max(f64::MIN_POSITIVE));
                // Values that leave nothing to explain have no slope to follow.
                let slope = if score < 0.0 { half / error } else { 0.0 };
                (-half * error.ln(), slope)
            }
        }
    }
}

/// `Σρ_iΛ_i²` and `Σρ_iP_ii`.
fn misfit_and_freedom(parts: &Parts<'_>) -> (f64, f64) {
    let squares = parts.weights.iter().zip(parts.relative_noise).map(|(weight, rho)| rho * weight * weight);
    (squares.sum(), dot(parts.relative_noise, parts.diagonal))
}
