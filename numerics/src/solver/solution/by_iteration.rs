//! Weights by landmarks and by conjugate gradients.

use super::Solution;
use super::candidate::{Candidate, MAX_RELATIVE_RESIDUAL, norm2};
use crate::error::{NotDefinite, NumericsError, Result};
use crate::observer::Observer;
use crate::solver::Solver;
use crate::solver::conjugate_gradients::{Goal, Preconditioned, SAFETY, SLACK, conjugate_gradients};
use crate::solver::iterative::Iterative;
use crate::solver::landmark::{Landmarks, TrueResidual};

/// Largest number of times that conjugate gradients begin, the last ones with what is left.
const RESTARTS: usize = 3;

/// Relative residual of the true system at which weights by landmarks are as good as those of a factor.
const LANDMARK_TOLERANCE: f64 = 1e-11;

impl Solution {
    /// Solves on landmarks, and where they precondition the true system, goes on with that. The residual is
    /// that of the true system in any case.
    pub(super) fn on_landmarks(
        solver: &Solver,
        landmarks: &Landmarks,
        values: &[f64],
        observer: &dyn Observer,
    ) -> Result<Self> {
        let fitted = landmarks.fit(values, observer)?;
        if fitted.at_landmarks.iter().chain(&fitted.weights).any(|w| !w.is_finite()) {
            return Err(NumericsError::WeightsOverflow);
        }
        let solution = if landmarks.preconditions() {
            let weights = Some(fitted.weights);
            let iteration = Iteration { of: landmarks, weights, tolerance: LANDMARK_TOLERANCE };
            iteration.run(solver, values, observer)?
        } else {
            let TrueResidual { relative, max } = TrueResidual::of(landmarks, values, &fitted, observer)?;
            let misfits: Vec<f64> = fitted.at_points.iter().zip(values).map(|(u, y)| u - y).collect();
            Self {
                misfit: norm2(&misfits),
                weights: landmarks.as_expansion(fitted.at_landmarks),
                relative_residual: relative,
                residual_max: max,
                native_norm_squared: fitted.native_norm_squared,
                energy: fitted.energy,
                refined: false,
                n_iterations: None,
                trend: None,
                outlier: None,
            }
        };
        let relative_residual = solution.relative_residual;
        if relative_residual.is_nan() || relative_residual > MAX_RELATIVE_RESIDUAL {
            return Err(solver.not_positive_definite(NotDefinite::Residual { relative_residual }));
        }
        Ok(solution)
    }

    /// Solves by conjugate gradients to their tolerance.
    pub(super) fn iterated(
        solver: &Solver,
        iterative: &Iterative,
        values: &[f64],
        observer: &dyn Observer,
    ) -> Result<Self> {
        let iteration = Iteration { of: iterative, weights: None, tolerance: iterative.tolerance() };
        let solution = iteration.run(solver, values, observer)?;
        let relative_residual = solution.relative_residual;
        if relative_residual.is_nan() || relative_residual > iterative.tolerance() {
            return Err(iterative.not_converged(relative_residual));
        }
        Ok(solution)
    }
}

/// Conjugate gradients on the true system from given weights, or from none.
struct Iteration<'a> {
    of: &'a dyn Preconditioned,
    weights: Option<Vec<f64>>,
    tolerance: f64,
}

impl Iteration<'_> {
    /// Iterates, again for what is left where the true residual is not that of the recurrence. The caller
    /// sees to the residual.
    fn run(self, solver: &Solver, values: &[f64], observer: &dyn Observer) -> Result<Solution> {
        let nothing = || vec![0.0; values.len()];
        let (mut left, mut n_iterations) = match self.weights {
            Some(weights) => (Candidate::new(solver, values, weights, None, observer)?, 0),
            None => (Candidate::evaluated(solver, values, nothing(), nothing()), 0),
        };
        for _ in 0..RESTARTS {
            let part = left.relative_residual(values);
            if part <= self.tolerance {
                break;
            }
            let goal = Goal { tolerance: SAFETY * self.tolerance / part, slack: SLACK };
            let mut weights = left.weights.clone();
            for found in conjugate_gradients(self.of, &left.residual, goal, observer)? {
                n_iterations += found.n_iterations;
                weights.iter_mut().zip(&found.x).for_each(|(weight, x)| *weight += x);
            }
            left = Candidate::new(solver, values, weights, None, observer)?;
        }
        Ok(Solution { n_iterations: Some(n_iterations), ..left.into_solution(solver, values, false) })
    }
}
