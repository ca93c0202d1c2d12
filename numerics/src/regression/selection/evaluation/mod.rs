//! Evaluation of a criterion and its slopes at given hyperparameters.
//!
//! A score takes a factorization, n³/3 flops. The slopes of the likelihood take 2n³/3 more, for the inverse
//! from the factor. Criteria that need the diagonal of the inverse spend half of that already on the score.
//! Their slopes take another matrix product, n³. All parameters of the kernel share one pass over the pairs
//! (contraction.rs).

mod contraction;
mod matrices;
pub(super) mod space;

use faer::Mat;

use crate::error::{NotDefinite, NumericsError, Result};
use crate::kernel::Kernel;
use crate::machine::vector::dot;
use crate::observer::Observer;
use crate::regression::selection::criterion::{Criterion, Parts};
use crate::regression::selection::parameters::Hyperparameters;
use crate::regression::selection::subject::{Subject, relative_noise};
use crate::regression::solver::trend::{Trend, remove_mean, solve_gram};
use contraction::{Contraction, PairWeights};
use matrices::Matrices;
use space::Space;

/// Least share of `W_ii` that the mean must leave in `P_ii`. Less is rounding.
pub(super) const UNDETERMINED: f64 = 1e-12;

/// An evaluator of a criterion, with the matrices of its last evaluation.
pub(super) struct Evaluator<'a> {
    pub(super) subject: &'a Subject<'a>,
    criterion: Criterion,
    pub(super) matrices: Matrices,
}

/// The result of a factorization. The evaluator keeps the factor.
pub(super) struct State {
    kernel: Kernel,
    /// Λ, `[n]`.
    pub(super) weights: Vec<f64>,
    /// T, the product of `L⁻ᵀ` and an orthonormal basis of `L⁻¹F`, `[n, p]`. Hence `P = W − TTᵀ`.
    of_mean: Vec<f64>,
    /// `P_ii`, `[n]`, 0 where the mean leaves nothing of `W_ii`. Empty if the criterion does not need it.
    diagonal: Vec<f64>,
    relative_noise: Vec<f64>,
    energy: f64,
    log_determinant: f64,
    pub(super) score: f64,
}

impl State {
    fn parts(&self) -> Parts<'_> {
        Parts {
            energy: self.energy,
            log_determinant: self.log_determinant,
            weights: &self.weights,
            diagonal: &self.diagonal,
            relative_noise: &self.relative_noise,
        }
    }

    /// Returns Λ, and `P_ii` if the criterion needs it.
    pub(super) fn into_weights_and_diagonal(self) -> (Vec<f64>, Vec<f64>) {
        (self.weights, self.diagonal)
    }
}

impl<'a> Evaluator<'a> {
    /// Creates an evaluator that works on the calling thread alone, if `is_alone`, or on all threads.
    pub(super) fn new(subject: &'a Subject<'a>, criterion: Criterion, is_alone: bool) -> Self {
        Self { subject, criterion, matrices: Matrices::new(subject.n_points(), is_alone) }
    }

    pub(super) fn criterion(&self) -> Criterion {
        self.criterion
    }

    pub(super) fn n_points(&self) -> usize {
        self.subject.n_points()
    }

    /// Returns the state at these hyperparameters. `None` if the matrix is not positive definite in float64,
    /// or if the score is not finite.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`], and the errors of [`Hyperparameters::kernel_on`].
    pub(super) fn score(&mut self, at: &Hyperparameters, observer: &dyn Observer) -> Result<Option<State>> {
        Ok(self.state(at, observer)?.filter(|state| state.score.is_finite()))
    }

    /// Returns the state at these hyperparameters, even if its score is not finite. `None` if the matrix is
    /// not positive definite in float64.
    ///
    /// # Errors
    /// Returns the errors of [`Evaluator::score`].
    pub(super) fn state(&mut self, at: &Hyperparameters, observer: &dyn Observer) -> Result<Option<State>> {
        let kernel = at.kernel_on(self.subject.cloud)?;
        if !self.matrices.factorize(self.subject.cloud, &kernel, &at.noise, observer)? {
            return Ok(None);
        }
        observer.checkpoint()?;
        let (n, p) = (self.subject.n_points(), self.subject.n_functions);
        let mut columns = self.whitened();
        if remove_mean(&mut columns, n, p).is_none() {
            return Ok(None);
        }
        let energy = dot(&columns[p * n..], &columns[p * n..]);
        self.matrices.solve_whitened(&mut columns);
        let weights = columns.split_off(p * n);
        let mut state = State {
            kernel,
            weights,
            of_mean: columns,
            diagonal: Vec::new(),
            relative_noise: relative_noise(&at.noise, n),
            energy,
            log_determinant: self.matrices.log_determinant(),
            score: f64::NAN,
        };
        if self.criterion.needs_diagonal() {
            state.diagonal = self.diagonal(&state.of_mean, observer)?;
        }
        state.score = self.criterion.score(&state.parts());
        Ok(Some(state))
    }

    /// Returns the derivatives of the score by the logarithms of the free numbers, at the hyperparameters of
    /// the last score.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(super) fn gradient(
        &mut self,
        space: &Space,
        at: &Hyperparameters,
        state: &State,
        observer: &dyn Observer,
    ) -> Result<Vec<f64>> {
        if space.n_free() == 0 {
            return Ok(Vec::new());
        }
        let sensitivity = self.criterion.sensitivity(&state.parts());
        self.matrices.invert_factor(observer)?;
        self.matrices.multiply_inverse(observer)?;
        let mut right = sensitivity.right;
        if let Some(of_columns) = &sensitivity.of_columns {
            right = self.projected(&state.of_mean, right);
            self.matrices.multiply_columns(&state.of_mean, of_columns, observer)?;
        }
        observer.checkpoint()?;
        let weights = PairWeights {
            matrix: self.matrices.product(),
            scale: sensitivity.scale,
            left: &state.weights,
            right: &right,
        };
        let contraction = Contraction {
            cloud: self.subject.cloud,
            kernel: &state.kernel,
            weights: &weights,
            per_axis: space.per_axis(),
            is_alone: self.matrices.is_alone,
        };
        let sums = contraction.sums(observer)?;
        Ok(space.gradient(at, &sums, weights.trace()))
    }

    /// Returns the mean with its coefficients `(FᵀWF)⁻¹FᵀWY`, after a score. `None` if there is no mean.
    pub(super) fn trend(&self) -> Option<Trend> {
        let (n, p) = (self.subject.n_points(), self.subject.n_functions);
        let columns = self.whitened();
        let column = |a: usize| &columns[a * n..][..n];
        let gram = Mat::from_fn(p, p, |a, b| dot(column(a), column(b)));
        let solved = solve_gram(&gram, Mat::from_fn(p, 1, |a, _| dot(column(a), column(p))))?;
        self.subject.trend((0..p).map(|a| solved[(a, 0)]).collect())
    }

    /// Returns `L⁻¹` times the functions of the mean and the values, `[n, p + 1]`.
    fn whitened(&self) -> Vec<f64> {
        let mut columns = self.subject.functions.clone();
        columns.extend_from_slice(&self.subject.values);
        self.matrices.whiten(&mut columns);
        columns
    }

    /// Computes `P_ii = W_ii − |T_i|²`, and 0 where that is rounding: no other value then says anything about
    /// the value of the point.
    fn diagonal(&mut self, of_mean: &[f64], observer: &dyn Observer) -> Result<Vec<f64>> {
        self.matrices.invert_factor(observer)?;
        let n = self.subject.n_points();
        let entry = |(i, of_inverse): (usize, f64)| {
            let of_mean: f64 = of_mean.chunks_exact(n).map(|t| t[i] * t[i]).sum();
            let left = of_inverse - of_mean;
            if left <= UNDETERMINED * of_inverse { 0.0 } else { left }
        };
        Ok(self.matrices.inverse_diagonal().into_iter().enumerate().map(entry).collect())
    }

    /// Returns `P` times a vector.
    fn projected(&self, of_mean: &[f64], vector: Vec<f64>) -> Vec<f64> {
        let n = vector.len();
        let along: Vec<f64> = of_mean.chunks_exact(n).map(|t| dot(t, &vector)).collect();
        let mut found = vector;
        self.matrices.whiten(&mut found);
        self.matrices.solve_whitened(&mut found);
        for (t, along) in of_mean.chunks_exact(n).zip(along) {
            found.iter_mut().zip(t).for_each(|(entry, t)| *entry -= along * t);
        }
        found
    }
}

/// Returns the refusal of these hyperparameters with an α that is large enough: `4nε‖K‖₁`, where `‖K‖₁` is at
/// most `nv`.
pub(super) fn never_definite(at: &Hyperparameters, n: usize) -> NumericsError {
    let minimum_alpha = 4.0 * (n as f64).powi(2) * f64::EPSILON * at.variance;
    NumericsError::NotPositiveDefinite { reason: NotDefinite::Unfactorable, minimum_alpha }
}

#[cfg(test)]
mod tests;
