//! Weights for given values, and measures of their accuracy.

mod by_iteration;
mod candidate;
mod many;
mod residuals;

use faer::MatMut;

use super::Solver;
use super::trend::{Mean, Trend};
use crate::error::{NumericsError, Result};
use crate::machine::heap::vec_bytes;
use crate::observer::{Observer, Stage};
use crate::sums::jets::{JetOrder, Jets};
use candidate::Candidate;
pub(crate) use candidate::MAX_RELATIVE_RESIDUAL;
pub use residuals::{Disagreement, Outlier, Place};

/// Weights `Λ = (K + αI)⁻¹ Y` with their residual and norms. If the function has a mean, Y is the values
/// without it.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Weights Λ, one for each centre of the solver's expansions: `[n]`, or `[r]` for the fallback.
    pub weights: Vec<f64>,
    /// `‖Y − (K + αI)Λ‖₂ / ‖Y‖₂`, 0 for Y = 0.
    pub relative_residual: f64,
    /// `‖Y − (K + αI)Λ‖_∞`, unit of the values.
    pub residual_max: f64,
    /// `‖u‖²_H = Λᵀ K Λ`.
    pub native_norm_squared: f64,
    /// `|u(X) − Y|₂`, unit of the values; 0 up to rounding at α = 0.
    pub misfit: f64,
    /// `YᵀΛ`, which is `|L⁻¹Y|²`.
    pub energy: f64,
    /// Whether a step of iterative refinement was kept.
    pub refined: bool,
    /// Number of iterations, if the solver iterates.
    pub n_iterations: Option<usize>,
    /// The mean, if there is one.
    pub trend: Option<Trend>,
    /// The value that the others explain worst, under the variance of the solver's kernel. `None` if it was
    /// not looked for.
    pub outlier: Option<Outlier>,
}

impl Solution {
    /// Solves for values `[n]`. Checks the residual against the matrix itself, not its solver, and refines
    /// once where that helps.
    ///
    /// # Errors
    /// [`NumericsError::LengthMismatch`], [`NumericsError::WeightsOverflow`], [`NumericsError::Cancelled`].
    /// [`NumericsError::NotPositiveDefinite`] if the residual exceeds 1e-5 or the backward error 1e-13.
    pub fn of(solver: &Solver, values: &[f64], observer: &dyn Observer) -> Result<Self> {
        Ok(Self::solve(solver, values, None, observer)?.0)
    }

    /// Computes [`Solution::of`] for a function with a mean, and finds the value that the others explain
    /// worst.
    ///
    /// # Errors
    /// [`NumericsError::MeanNotDetermined`], and the errors of [`Solution::of`].
    pub fn with_mean(solver: &Solver, values: &[f64], mean: Mean, observer: &dyn Observer) -> Result<Self> {
        solver.cloud().check_one_per_point(values)?;
        observer.enter(Stage::Solve);
        let found = match Trend::fit(solver, values, mean, observer)? {
            None => Self::of(solver, values, observer)?,
            Some(trend) => {
                let rest = trend.removed_from(values, solver.cloud());
                Self { trend: Some(trend), ..Self::of(solver, &rest, observer)? }
            }
        };
        let outlier = Outlier::of(solver, &found.weights, observer)?;
        Ok(Self { outlier, ..found })
    }

    /// Computes [`Solution::of`] with the jets of the function at the points. Their values are needed for the
    /// residual anyway.
    ///
    /// # Errors
    /// [`NumericsError::Overflow`] of derivatives, and the errors of [`Solution::of`].
    pub(crate) fn with_jets(
        solver: &Solver,
        values: &[f64],
        order: JetOrder,
        observer: &dyn Observer,
    ) -> Result<(Self, Option<Jets>)> {
        Self::solve(solver, values, Some(order), observer)
    }

    fn solve(
        solver: &Solver,
        values: &[f64],
        order: Option<JetOrder>,
        observer: &dyn Observer,
    ) -> Result<(Self, Option<Jets>)> {
        solver.cloud().check_one_per_point(values)?;
        observer.enter(Stage::Solve);
        let by_other_means = match (solver.landmarks(), solver.iterative()) {
            (Some(landmarks), _) => Some(Self::on_landmarks(solver, landmarks, values, observer)?),
            (None, Some(iterative)) => Some(Self::iterated(solver, iterative, values, observer)?),
            (None, None) => None,
        };
        if let Some(solution) = by_other_means {
            observer.solved_to(solution.relative_residual);
            let at = |order| solver.expansion(&solution.weights).at(solver.cloud(), order, observer);
            let jets = order.map(at).transpose()?;
            return Ok((solution, jets));
        }
        let candidate = |weights| Candidate::new(solver, values, weights, order, observer);
        let is_one = values.iter().all(|&value| value == 1.0);
        let weights = if is_one {
            solver.weights_of_one(observer)?.into_owned()
        } else {
            solve(solver, values, observer)?
        };
        let mut best = candidate(weights)?;
        let mut refined = false;
        if best.wants_refinement(solver, values) {
            let correction = solve(solver, &best.residual, observer)?;
            let weights = best.weights.iter().zip(&correction).map(|(a, b)| a + b).collect();
            match candidate(weights) {
                Ok(next) if next.relative_residual(values) < best.relative_residual(values) => {
                    (best, refined) = (next, true);
                }
                Err(NumericsError::Cancelled) => return Err(NumericsError::Cancelled),
                Ok(_) | Err(_) => {}
            }
        }
        observer.solved_to(best.relative_residual(values));
        best.accept(solver, values, refined)
    }

    /// Bytes held on the heap.
    pub fn n_bytes(&self) -> usize {
        vec_bytes(&self.weights) + self.trend.as_ref().map_or(0, Trend::n_bytes)
    }
}

fn solve(solver: &Solver, values: &[f64], observer: &dyn Observer) -> Result<Vec<f64>> {
    let mut weights = values.to_vec();
    let n = weights.len();
    solver.solve_in_place(MatMut::from_column_major_slice_mut(&mut weights, n, 1), observer)?;
    Ok(weights)
}
