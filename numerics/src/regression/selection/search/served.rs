//! Check that a solver serves what a search finds.

use crate::regression::selection::evaluation::{Evaluator, State};
use crate::regression::selection::parameters::Hyperparameters;
use crate::regression::solver::MAX_RELATIVE_RESIDUAL;

/// Least reciprocal condition that passes. A solver refuses variances and determinants below ε. Near that
/// limit, factors from two orders of summation have estimates that differ by a factor of a few.
const LEAST_RECIPROCAL_CONDITION: f64 = 16.0 * f64::EPSILON;

/// Backward error of a solve by Cholesky: a few roundings.
const BACKWARD_ERROR: f64 = 4.0 * f64::EPSILON;

/// Multiple of `√n ‖K + N‖₁` at which noise passes both tests whatever the values, since `‖W‖₁ ≤ √n/α` and
/// `‖Λ‖ ≤ ‖Y‖/α`.
const SURE: f64 = 1e-10;

impl Evaluator<'_> {
    /// Returns whether a solver with the hyperparameters of the last score has a small enough residual, and
    /// gives variances and determinants. A client can then send selected hyperparameters back and is served.
    pub(super) fn is_served(&self, at: &Hyperparameters, state: &State) -> bool {
        let (n, norm1) = (self.n_points(), self.matrices.norm1());
        let root = (n as f64).sqrt();
        let least_noise = (0..n).map(|i| at.noise.at(i)).fold(f64::INFINITY, f64::min);
        if least_noise >= SURE * root * norm1 {
            return true;
        }
        let greatest = state.weights.iter().fold(0.0f64, |greatest, weight| greatest.max(weight.abs()));
        let residual = BACKWARD_ERROR * root * norm1 * greatest;
        residual <= MAX_RELATIVE_RESIDUAL * self.subject.rest()
            && self.matrices.reciprocal_condition() >= LEAST_RECIPROCAL_CONDITION
    }
}
