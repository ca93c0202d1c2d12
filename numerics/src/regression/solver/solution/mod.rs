//! Weights for given values, and measures of their accuracy.

mod by_iteration;
mod candidate;
mod many;
mod residuals;
mod warm_start;

use std::sync::Arc;

use faer::MatMut;

use super::Solver;
use super::trend::{Mean, Trend};
use crate::error::{NumericsError, Result};
use crate::machine::heap::vec_bytes;
use crate::observer::{Observer, Stage};
use crate::regression::sums::jets::{JetOrder, Jets};
use candidate::Candidate;
pub(crate) use candidate::MAX_RELATIVE_RESIDUAL;
pub use residuals::{Autocorrelation, Disagreement, Outlier, Place};

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
    /// `(K + αI)Λ`, `[n]`, from which a later solve may start. Empty unless the solver iterates.
    pub product: Vec<f64>,
    /// The mean, if there is one.
    pub trend: Option<Trend>,
    /// The value that the others explain worst, under the variance of the solver's kernel. `None` if it was
    /// not looked for.
    pub outlier: Option<Outlier>,
}

/// Values `[n]` to be solved for, and solutions of the same system for others, or to another tolerance.
///
/// A solver that iterates starts from the earlier ones. The others have no use for them.
#[derive(Clone, Copy)]
pub struct RightHandSide<'a> {
    pub values: &'a [f64],
    pub earlier: &'a [Arc<Solution>],
}

impl<'a> RightHandSide<'a> {
    /// Values of a system that was not solved before.
    pub fn first(values: &'a [f64]) -> Self {
        Self { values, earlier: &[] }
    }
}

/// What was solved before with the same system.
#[derive(Default)]
pub struct EarlierSolutions {
    /// Weights of the values that are requested.
    pub these: Option<Arc<Solution>>,
    /// Weights of other values, or to another tolerance. The latest is first.
    pub earlier: Vec<Arc<Solution>>,
}

impl Solution {
    /// Solves for values `[n]`. Checks the residual against the matrix itself, not its solver, and refines
    /// once where that helps.
    ///
    /// # Errors
    /// [`NumericsError::LengthMismatch`], [`NumericsError::WeightsOverflow`], [`NumericsError::Cancelled`].
    /// [`NumericsError::NotPositiveDefinite`] if the residual exceeds 1e-5 or the backward error 1e-13.
    pub fn of(solver: &Solver, values: &[f64], observer: &dyn Observer) -> Result<Self> {
        Ok(Self::with_jets(solver, RightHandSide::first(values), None, observer)?.0)
    }

    /// Computes [`Solution::of`] for a function with a mean, and finds the value that the others explain
    /// worst.
    ///
    /// # Errors
    /// [`NumericsError::MeanNotDetermined`], and the errors of [`Solution::of`].
    pub fn with_mean(solver: &Solver, values: &[f64], mean: Mean, observer: &dyn Observer) -> Result<Self> {
        Self::starting(solver, RightHandSide::first(values), mean, observer)
    }

    /// Computes [`Solution::with_mean`], from earlier solutions where that takes less work. Weights depend on
    /// them within the tolerance.
    ///
    /// # Errors
    /// Returns the errors of [`Solution::with_mean`].
    pub fn starting(
        solver: &Solver,
        sought: RightHandSide<'_>,
        mean: Mean,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let RightHandSide { values, earlier } = sought;
        solver.cloud().check_one_per_point(values)?;
        observer.enter(Stage::Solve);
        let found = match Trend::fit(solver, values, mean, observer)? {
            None => Self::with_jets(solver, sought, None, observer)?.0,
            Some(trend) => {
                let rest = trend.removed_from(values, solver.cloud());
                let rest = RightHandSide { values: &rest, earlier };
                Self { trend: Some(trend), ..Self::with_jets(solver, rest, None, observer)?.0 }
            }
        };
        let outlier = Outlier::of(solver, &found.weights, observer)?;
        Ok(Self { outlier, ..found })
    }

    /// Computes [`Solution::of`], and the jets of the function at the points if they are requested. Their
    /// values are needed for the residual anyway.
    ///
    /// # Errors
    /// [`NumericsError::Overflow`] of derivatives, and the errors of [`Solution::of`].
    pub(crate) fn with_jets(
        solver: &Solver,
        sought: RightHandSide<'_>,
        order: Option<JetOrder>,
        observer: &dyn Observer,
    ) -> Result<(Self, Option<Jets>)> {
        let values = sought.values;
        solver.cloud().check_one_per_point(values)?;
        observer.enter(Stage::Solve);
        let by_other_means = match (solver.landmarks(), solver.iterative()) {
            (Some(landmarks), _) => Some(Self::on_landmarks(solver, landmarks, values, observer)?),
            (None, Some(iterative)) => Some(Self::iterated(solver, iterative, sought, observer)?),
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
        vec_bytes(&self.weights) + vec_bytes(&self.product) + self.trend.as_ref().map_or(0, Trend::n_bytes)
    }
}

fn solve(solver: &Solver, values: &[f64], observer: &dyn Observer) -> Result<Vec<f64>> {
    let mut weights = values.to_vec();
    let n = weights.len();
    solver.solve_in_place(MatMut::from_column_major_slice_mut(&mut weights, n, 1), observer)?;
    Ok(weights)
}
