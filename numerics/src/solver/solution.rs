//! Weights for given values, and measures of their accuracy.

use faer::MatMut;

use super::landmark::{Landmarks, TrueResidual};
use super::residuals::Outlier;
use super::trend::{Mean, Trend};
use super::{Method, Solver};
use crate::error::{NotDefinite, NumericsError, Result};
use crate::machine::heap::vec_bytes;
use crate::observer::{Observer, Stage};
use crate::sums::jets::{JetOrder, Jets};

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
        if let Some(landmarks) = solver.landmarks() {
            return Self::on_landmarks(solver, landmarks, values, order, observer);
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

    /// Solves on landmarks. The residual is that of the true system all the same.
    fn on_landmarks(
        solver: &Solver,
        landmarks: &Landmarks,
        values: &[f64],
        order: Option<JetOrder>,
        observer: &dyn Observer,
    ) -> Result<(Self, Option<Jets>)> {
        let fitted = landmarks.fit(values, observer)?;
        if fitted.at_landmarks.iter().chain(&fitted.weights).any(|w| !w.is_finite()) {
            return Err(NumericsError::WeightsOverflow);
        }
        let TrueResidual { relative, max } = TrueResidual::of(landmarks, values, &fitted, observer)?;
        if relative.is_nan() || relative > MAX_RELATIVE_RESIDUAL {
            let reason = NotDefinite::Residual { relative_residual: relative };
            return Err(solver.not_positive_definite(reason));
        }
        observer.solved_to(relative);
        let at = |order| solver.expansion(&fitted.at_landmarks).at(solver.cloud(), order, observer);
        let jets = order.map(at).transpose()?;
        let misfits: Vec<f64> = fitted.at_points.iter().zip(values).map(|(u, y)| u - y).collect();
        let solution = Self {
            misfit: norm2(&misfits),
            weights: fitted.at_landmarks,
            relative_residual: relative,
            residual_max: max,
            native_norm_squared: fitted.native_norm_squared,
            energy: fitted.energy,
            refined: false,
            trend: None,
            outlier: None,
        };
        Ok((solution, jets))
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

/// Weights at all points with their residual, and with `KΛ` evaluated afresh from the kernel.
pub(super) struct Candidate {
    weights: Vec<f64>,
    at_points: Vec<f64>,
    /// Jets to the requested order.
    jets: Option<Jets>,
    residual: Vec<f64>,
}

impl Candidate {
    fn new(
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

    fn relative_residual(&self, values: &[f64]) -> f64 {
        let scale = norm2(values);
        if scale == 0.0 { 0.0 } else { norm2(&self.residual) / scale }
    }

    /// Returns the backward error `‖Y − (K + αI)Λ‖_∞/(‖K + αI‖_∞ ‖Λ‖_∞ + ‖Y‖_∞)` (Higham 2002, th. 7.1).
    fn backward_error(&self, solver: &Solver, values: &[f64]) -> f64 {
        let scale = solver.norm1() * norm_max(&self.weights) + norm_max(values);
        if scale == 0.0 { 0.0 } else { norm_max(&self.residual) / scale }
    }

    pub(super) fn accept(
        self,
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
        let native_norm_squared = self.weights.iter().zip(&self.at_points).map(|(w, u)| w * u).sum();
        let energy = self.weights.iter().zip(values).map(|(w, y)| w * y).sum();
        let misfits: Vec<f64> = self.at_points.iter().zip(values).map(|(u, y)| u - y).collect();
        let misfit = norm2(&misfits);
        let solution = Solution {
            weights: solver.at_centres(&self.weights),
            relative_residual,
            residual_max: norm_max(&self.residual),
            native_norm_squared,
            misfit,
            energy,
            refined,
            trend: None,
            outlier: None,
        };
        Ok((solution, self.jets))
    }
}

/// Returns the 2-norm, scaled so that squares neither overflow nor vanish.
fn norm2(x: &[f64]) -> f64 {
    let largest = norm_max(x);
    if largest == 0.0 || !largest.is_finite() {
        return largest;
    }
    largest * x.iter().map(|v| (v / largest) * (v / largest)).sum::<f64>().sqrt()
}

fn norm_max(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |a, &b| if b.is_nan() { f64::NAN } else { a.max(b.abs()) })
}
