//! Weights by landmarks and by conjugate gradients.

use super::candidate::{Candidate, MAX_RELATIVE_RESIDUAL, norm2};
use super::warm_start::warm_start;
use super::{RightHandSide, Solution};
use crate::error::{NotDefinite, NumericsError, Result};
use crate::observer::Observer;
use crate::regression::solver::Solver;
use crate::regression::solver::conjugate_gradients::{
    Goal, Preconditioned, SAFETY, SLACK, conjugate_gradients,
};
use crate::regression::solver::iterative::Iterative;
use crate::regression::solver::iterative::price::EXPECTED_ITERATIONS;
use crate::regression::solver::landmark::{Landmarks, TrueResidual};

/// Largest number of times that conjugate gradients begin, the last ones with what is left.
const RESTARTS: usize = 3;

/// Part of the iterations that prices assume. A solve with fewer is not used to predict others.
const LEAST_OF_PRICE: f64 = 0.5;

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
            let start = Candidate::new(solver, values, fitted.weights, None, observer)?;
            let iteration = Iteration { of: landmarks, start, tolerance: LANDMARK_TOLERANCE };
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
                product: Vec::new(),
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

    /// Solves by conjugate gradients to their tolerance, from earlier solutions where they are near.
    pub(super) fn iterated(
        solver: &Solver,
        iterative: &Iterative,
        sought: RightHandSide<'_>,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let (values, tolerance) = (sought.values, iterative.tolerance());
        let start = match warm_start(solver, sought, observer)? {
            None => Candidate::nothing(solver, values),
            // Nothing is left to iterate, but the residual of an answer is always summed afresh.
            Some(start) if start.relative_residual(values) <= tolerance => {
                Candidate::new(solver, values, start.weights, None, observer)?
            }
            Some(start) => start,
        };
        let iteration = Iteration { of: iterative, start, tolerance };
        let solution = iteration.run(solver, values, observer)?;
        if solution.n_iterations.is_some_and(|n| (n as f64) < LEAST_OF_PRICE * EXPECTED_ITERATIONS) {
            observer.ended_early();
        }
        let relative_residual = solution.relative_residual;
        if relative_residual.is_nan() || relative_residual > tolerance {
            return Err(iterative.not_converged(relative_residual));
        }
        Ok(solution)
    }
}

/// Conjugate gradients on the true system from a start.
struct Iteration<'a> {
    of: &'a dyn Preconditioned,
    start: Candidate,
    tolerance: f64,
}

impl Iteration<'_> {
    /// Iterates, again for what is left where the true residual is not that of the recurrence. The caller
    /// sees to the residual.
    fn run(self, solver: &Solver, values: &[f64], observer: &dyn Observer) -> Result<Solution> {
        let (mut left, mut n_iterations) = (self.start, 0);
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
        let (n_iterations, product) = (Some(n_iterations), left.product(values));
        Ok(Solution { n_iterations, product, ..left.into_solution(solver, values, false) })
    }
}
