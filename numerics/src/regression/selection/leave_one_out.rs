//! Predictions of each value from all others.
//!
//! Let `P = W − WF(FᵀWF)⁻¹FᵀW`, `W = (K + N)⁻¹` and `Λ = PY`. All other values predict the value of point i
//! as `Y_i − Λ_i/P_ii`. The variance is `1/P_ii`, the noise of the value included. The coefficients of the
//! mean are those that the other values give (Rasmussen and Williams 2006, eqs. 5.12 and 5.13; Dubrule 1983).

use std::f64::consts::TAU;

use faer::{ColRef, MatMut};
use rayon::prelude::*;

use super::criterion::Criterion;
use super::evaluation::{Evaluator, UNDETERMINED, never_definite};
use super::parameters::Hyperparameters;
use super::subject::{Observations, Subject};
use crate::error::{NumericsError, Result};
use crate::observer::{Observer, Stage};
use crate::regression::solver::trend::Trend;
use crate::regression::solver::{Solution, Solver};
use crate::regression::sums::regularization::Regularization;

/// Number of columns of `L⁻¹` held at once.
const COLUMNS_PER_BLOCK: usize = 512;

/// Predictions of each value from all others, `[n]` each, in the order of the points. NaN where the mean is
/// not determined without the point.
#[derive(Debug, Clone, PartialEq)]
pub struct LeaveOneOut {
    /// Predicted values, unit V.
    pub means: Vec<f64>,
    /// Variances of the latent function, without noise, unit V². Negative results of rounding are replaced
    /// by 0.
    pub variances: Vec<f64>,
    /// Variances of the values, their own noise included, unit V².
    pub observation_variances: Vec<f64>,
    /// Log predictive densities `ln p(Y_i | Y_{−i})`, the noise of the value included.
    pub log_predictive_densities: Vec<f64>,
}

impl LeaveOneOut {
    /// Computes the predictions from Λ and `P_ii`. Kernel and noise are `factor` times those behind Λ and
    /// `P_ii`.
    fn of(values: &[f64], weights: &[f64], diagonal: &[f64], noise: &Regularization, factor: f64) -> Self {
        let each = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
            (0..values.len()).map(|i| if diagonal[i] > 0.0 { of(i) } else { f64::NAN }).collect()
        };
        let means = each(&|i| values[i] - weights[i] / diagonal[i]);
        let observation_variances = each(&|i| factor / diagonal[i]);
        let variances = each(&|i| (observation_variances[i] - factor * noise.at(i)).max(0.0));
        let log_predictive_densities = each(&|i| {
            let misfit = weights[i] * weights[i] / (factor * diagonal[i]);
            -0.5 * ((TAU * observation_variances[i]).ln() + misfit)
        });
        Self { means, variances, observation_variances, log_predictive_densities }
    }

    /// Returns the sum of the log densities, the score of [`Criterion::LeaveOneOut`].
    pub fn score(&self) -> f64 {
        self.log_predictive_densities.iter().sum()
    }
}

/// Predicts each value with an existing factorization, in n³ flops. Kernel and noise are `factor` times those
/// of the solver.
///
/// # Errors
/// [`NumericsError::LengthMismatch`]. [`NumericsError::NotPositiveDefinite`] if there is no Cholesky factor.
/// [`NumericsError::MeanNotDetermined`] if the mean is not determined without one of the points.
/// [`NumericsError::Cancelled`].
pub fn leave_one_out(
    solver: &Solver,
    solution: &Solution,
    values: &[f64],
    factor: f64,
    observer: &dyn Observer,
) -> Result<LeaveOneOut> {
    solver.cloud().check_one_per_point(values)?;
    observer.enter(Stage::Solve);
    let mut diagonal = inverse_diagonal(solver, observer)?;
    if let Some(trend) = &solution.trend {
        remove_mean(&mut diagonal, solver, trend, observer)?;
    }
    Ok(LeaveOneOut::of(values, &solution.weights, &diagonal, solver.regularization(), factor))
}

/// Predicts each value under hyperparameters, with a factorization of its own, in 2n³/3 flops. Predictions
/// are NaN at points without which the mean is not determined.
///
/// # Errors
/// [`NumericsError::LengthMismatch`], [`NumericsError::NotPositiveDefinite`], [`NumericsError::Cancelled`].
/// [`NumericsError::MeanNotDetermined`] if all points together do not determine the mean. Also the errors of
/// [`Hyperparameters::kernel_on`].
pub fn leave_one_out_with(
    observations: Observations<'_>,
    at: &Hyperparameters,
    observer: &dyn Observer,
) -> Result<LeaveOneOut> {
    let Observations { cloud, values, .. } = observations;
    let subject = Subject::of(observations)?;
    at.noise.check_matches(cloud)?;
    observer.enter(Stage::Factor);
    let mut evaluator = Evaluator::new(&subject, Criterion::LeaveOneOut, false);
    let state = evaluator.state(at, observer)?.ok_or_else(|| never_definite(at, values.len()))?;
    let (weights, diagonal) = state.into_weights_and_diagonal();
    Ok(LeaveOneOut::of(values, &weights, &diagonal, &at.noise, 1.0))
}

/// Computes `W_ii = |L⁻¹e_i|²`, [`COLUMNS_PER_BLOCK`] columns at a time.
fn inverse_diagonal(solver: &Solver, observer: &dyn Observer) -> Result<Vec<f64>> {
    let n = solver.n_points();
    let mut buffer = vec![0.0; n * COLUMNS_PER_BLOCK.min(n)];
    let mut diagonal = Vec::with_capacity(n);
    while diagonal.len() < n {
        observer.checkpoint()?;
        let first = diagonal.len();
        let n_columns = COLUMNS_PER_BLOCK.min(n - first);
        let columns = &mut buffer[..n * n_columns];
        columns.fill(0.0);
        columns.chunks_exact_mut(n).enumerate().for_each(|(k, column)| column[first + k] = 1.0);
        solver.whiten_in_place(MatMut::from_column_major_slice_mut(columns, n, n_columns), observer)?;
        let norm = |column: &[f64]| ColRef::from_slice(column).squared_norm_l2();
        diagonal.extend(columns.par_chunks_exact(n).map(norm).collect::<Vec<f64>>());
    }
    Ok(diagonal)
}

/// Turns `W_ii` into `P_ii`: subtracts the diagonal of `WF(FᵀWF)⁻¹FᵀW`.
fn remove_mean(diagonal: &mut [f64], solver: &Solver, trend: &Trend, observer: &dyn Observer) -> Result<()> {
    let (n, basis) = (diagonal.len(), trend.basis());
    let functionals = basis.functionals(solver, observer)?;
    let mut weights = basis.columns(solver.cloud());
    let columns = MatMut::from_column_major_slice_mut(&mut weights, n, basis.n_functions());
    solver.solve_in_place(columns, observer)?;
    for (i, p) in diagonal.iter_mut().enumerate() {
        let pairs = weights.chunks_exact(n).zip(functionals.chunks_exact(n));
        let left = *p - pairs.map(|(weight, functional)| weight[i] * functional[i]).sum::<f64>();
        if left.is_nan() || left <= UNDETERMINED * *p {
            return Err(NumericsError::MeanNotDetermined);
        }
        *p = left;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
