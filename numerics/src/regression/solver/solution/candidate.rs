//! Weights with their residual, before they are accepted.

use super::Solution;
use crate::error::{NotDefinite, NumericsError, Result};
use crate::observer::Observer;
use crate::regression::solver::{Method, Solver};
use crate::regression::sums::jets::{JetOrder, Jets};

/// Relative residual above which a step of refinement may be worthwhile. Backward stable solves stay below it
/// unless the weights are huge compared to the values.
const REFINE_ABOVE: f64 = 1e-12;

/// Backward error of Cholesky up to which the residual is rounding. A refinement step in the same precision
/// took a fifth to two thirds off such a residual, which is noise. It costs another solve and another pass
/// over all pairs. This was seen for Matérn 5/2, Laplace and Gauss on 500 to 4,000 points, with reciprocal
/// conditions down to 3e-14.
///
/// The least squares of the fallback gain by refinement all the same: half of the error of the answers
/// (`tests/conditioning/smooth.rs`).
const ROUNDING: f64 = f64::EPSILON;

/// Largest relative residual of an answer. Beyond it, or beyond [`MAX_BACKWARD_ERROR`], no honest answer
/// exists (numerics.md, Fit 3).
pub(crate) const MAX_RELATIVE_RESIDUAL: f64 = 1e-5;
const MAX_BACKWARD_ERROR: f64 = 1e-13;

/// Weights at all points with their residual, and with `KΛ` evaluated afresh from the kernel.
pub(super) struct Candidate {
    pub(super) weights: Vec<f64>,
    at_points: Vec<f64>,
    /// Jets to the requested order.
    jets: Option<Jets>,
    pub(super) residual: Vec<f64>,
}

impl Candidate {
    pub(super) fn new(
        solver: &Solver,
        values: &[f64],
        weights: Vec<f64>,
        order: Option<JetOrder>,
        observer: &dyn Observer,
    ) -> Result<Self> {
        if weights.iter().any(|w| !w.is_finite()) {
            return Err(NumericsError::WeightsOverflow);
        }
        let at_centres = solver.at_centres(&weights);
        let (at_points, jets) = match order {
            None => (solver.expansion(&at_centres).values_at(solver.cloud(), observer)?, None),
            Some(order) => {
                let jets = solver.expansion(&at_centres).at(solver.cloud(), order, observer)?;
                (jets.values(), Some(jets))
            }
        };
        Ok(Self { jets, ..Self::evaluated(solver, values, weights, at_points) })
    }

    /// No weights, whose residual is the values.
    pub(super) fn nothing(solver: &Solver, values: &[f64]) -> Self {
        Self::evaluated(solver, values, vec![0.0; values.len()], vec![0.0; values.len()])
    }

    /// Creates a candidate from a given `KΛ`.
    pub(super) fn evaluated(solver: &Solver, values: &[f64], weights: Vec<f64>, at_points: Vec<f64>) -> Self {
        let residual = (0..values.len())
            .map(|i| values[i] - at_points[i] - solver.regularization().at(i) * weights[i])
            .collect();
        Self { weights, at_points, jets: None, residual }
    }

    /// Returns whether a step of refinement is promising.
    pub(super) fn wants_refinement(&self, solver: &Solver, values: &[f64]) -> bool {
        let is_rounding =
            || solver.method() == Method::Cholesky && self.backward_error(solver, values) <= ROUNDING;
        self.relative_residual(values) > REFINE_ABOVE && !is_rounding()
    }

    pub(super) fn relative_residual(&self, values: &[f64]) -> f64 {
        let scale = norm2(values);
        if scale == 0.0 { 0.0 } else { norm2(&self.residual) / scale }
    }

    /// Returns the backward error `‖Y − (K + αI)Λ‖_∞/(‖K + αI‖_∞ ‖Λ‖_∞ + ‖Y‖_∞)` (Higham 2002, th. 7.1).
    fn backward_error(&self, solver: &Solver, values: &[f64]) -> f64 {
        let scale = solver.norm1() * norm_max(&self.weights) + norm_max(values);
        if scale == 0.0 { 0.0 } else { norm_max(&self.residual) / scale }
    }

    pub(super) fn accept(
        mut self,
        solver: &Solver,
        values: &[f64],
        refined: bool,
    ) -> Result<(Solution, Option<Jets>)> {
        let relative_residual = self.relative_residual(values);
        let backward_error = self.backward_error(solver, values);
        if relative_residual.is_nan() || relative_residual > MAX_RELATIVE_RESIDUAL {
            return Err(solver.not_positive_definite(NotDefinite::Residual { relative_residual }));
        }
        if backward_error.is_nan() || backward_error > MAX_BACKWARD_ERROR {
            return Err(solver.not_positive_definite(NotDefinite::BackwardError { backward_error }));
        }
        let jets = self.jets.take();
        Ok((self.into_solution(solver, values, refined), jets))
    }

    /// `(K + αI)Λ`.
    pub(super) fn product(&self, values: &[f64]) -> Vec<f64> {
        values.iter().zip(&self.residual).map(|(y, left)| y - left).collect()
    }

    /// The solution as it stands.
    pub(super) fn into_solution(self, solver: &Solver, values: &[f64], refined: bool) -> Solution {
        let native_norm_squared = self.weights.iter().zip(&self.at_points).map(|(w, u)| w * u).sum();
        let energy = self.weights.iter().zip(values).map(|(w, y)| w * y).sum();
        let misfits: Vec<f64> = self.at_points.iter().zip(values).map(|(u, y)| u - y).collect();
        let misfit = norm2(&misfits);
        Solution {
            weights: solver.at_centres(&self.weights),
            relative_residual: self.relative_residual(values),
            residual_max: norm_max(&self.residual),
            native_norm_squared,
            misfit,
            energy,
            refined,
            n_iterations: None,
            product: Vec::new(),
            trend: None,
            outlier: None,
        }
    }
}

/// Returns the 2-norm, scaled so that squares neither overflow nor vanish.
pub(super) fn norm2(x: &[f64]) -> f64 {
    let largest = norm_max(x);
    if largest == 0.0 || !largest.is_finite() {
        return largest;
    }
    largest * x.iter().map(|v| (v / largest) * (v / largest)).sum::<f64>().sqrt()
}

fn norm_max(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |a, &b| if b.is_nan() { f64::NAN } else { a.max(b.abs()) })
}
