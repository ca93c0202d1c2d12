//! A criterion and its slopes at some hyperparameters.
//!
//! A score takes a factorization, n³/3 flops, and its slopes two more for the likelihood: the inverse comes from the factor. Scores made of the
//! diagonal of the inverse take the triangular half of that at once, and n³ for a product in their slopes. All parameters of the kernel share one
//! pass over the pairs (contraction.rs).

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::prelude::ReborrowMut;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use rayon::prelude::*;

use super::contraction::{PairWeights, contract};
use super::criterion::{Criterion, Parts};
use super::likelihood::remove_mean;
use super::parameters::{Hyperparameters, Space};
use crate::numerics::error::{NotDefinite, NumericsError};
use crate::numerics::kernel::Kernel;
use crate::numerics::machine::vector::dot;
use crate::numerics::observer::Observer;
use crate::numerics::points::cloud::Cloud;
use crate::numerics::solver::parallelism;
use crate::numerics::solver::trend::{Basis, Mean, Trend, solve_gram};
use crate::numerics::sums::gram::{fill_kernel_column, fill_lower_gram};
use crate::numerics::sums::nodes::Nodes;
use crate::numerics::sums::regularization::Regularization;

/// A pivot up to this multiple of k₀ is rounding, as in a factorization that is kept.
const SMALLEST_PIVOT: f64 = 16.0 * f64::EPSILON;

/// Values at the points of a cloud with a mean: what all evaluations share.
pub(super) struct Subject<'a> {
    pub(super) cloud: &'a Cloud,
    /// `[n]`, without what all of them share where there is a mean.
    pub(super) values: Vec<f64>,
    shared: f64,
    basis: Basis,
    /// F, `[n, p]` column by column.
    pub(super) functions: Vec<f64>,
    pub(super) n_functions: usize,
}

impl<'a> Subject<'a> {
    /// # Errors
    /// [`NumericsError::LengthMismatch`]; [`NumericsError::MeanNotDetermined`] if the points do not tell the functions of the mean apart, or there
    /// are no more of them.
    pub(super) fn of(cloud: &'a Cloud, values: &[f64], mean: Mean) -> Result<Self, NumericsError> {
        cloud.check_one_per_point(values)?;
        let (n, basis) = (values.len(), Basis::of(mean, cloud));
        let (functions, p) = (basis.columns(cloud), basis.n_functions());
        let column = |a: usize| &functions[a * n..][..n];
        let gram = Mat::from_fn(p, p, |a, b| dot(column(a), column(b)));
        if p > 0 && (n <= p || solve_gram(&gram, Mat::identity(p, p)).is_none()) {
            return Err(NumericsError::MeanNotDetermined);
        }
        // What all values share would cost digits of what they do not share.
        let shared = if p > 0 { values.iter().sum::<f64>() / n as f64 } else { 0.0 };
        let values = values.iter().map(|value| value - shared).collect();
        Ok(Self { cloud, values, shared, basis, functions, n_functions: p })
    }

    pub(super) fn n_points(&self) -> usize {
        self.values.len()
    }

    /// The mean with coefficients that generalised least squares found, `[p]`.
    fn trend(&self, mut coefficients: Vec<f64>) -> Option<Trend> {
        *coefficients.first_mut()? += self.shared;
        Some(Trend::new(self.basis.clone(), coefficients))
    }
}

/// Evaluates a criterion, in memory that is kept between evaluations: three matrices.
pub(super) struct Evaluator<'a> {
    subject: &'a Subject<'a>,
    criterion: Criterion,
    /// One of many tasks: threads that wait for parts of it would begin others, with memory of their own.
    is_alone: bool,
    par: Par,
    /// L, lower, column by column.
    factor: Vec<f64>,
    /// L⁻¹ first, then what is multiplied by its own transpose.
    inverse_factor: Vec<f64>,
    /// M of [`PairWeights`], lower.
    matrix: Vec<f64>,
    scratch: MemBuffer,
}

/// What a factorization says; the evaluator holds the factor.
pub(super) struct State {
    cloud: Cloud,
    kernel: Kernel,
    /// Λ, `[n]`.
    weights: Vec<f64>,
    /// `L⁻ᵀ` times an orthonormal basis of `L⁻¹F`, `[n, p]`: `P = W − TTᵀ`.
    of_mean: Vec<f64>,
    /// `P_ii`, `[n]`; empty where it does not count.
    diagonal: Vec<f64>,
    relative_noise: Vec<f64>,
    energy: f64,
    log_determinant: f64,
    pub(super) score: f64,
    has_inverse_factor: bool,
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

    /// Λ, and `P_ii` where it was asked for.
    pub(super) fn into_weights_and_diagonal(self) -> (Vec<f64>, Vec<f64>) {
        (self.weights, self.diagonal)
    }
}

impl<'a> Evaluator<'a> {
    /// Alone on its thread, or with all of them.
    pub(super) fn new(subject: &'a Subject<'a>, criterion: Criterion, is_alone: bool) -> Self {
        let n = subject.n_points();
        let flops = (n as f64).powi(3) / 3.0;
        let par = if is_alone { Par::Seq } else { parallelism(flops) };
        let scratch =
            MemBuffer::new(llt::factor::cholesky_in_place_scratch::<f64>(n, par, Default::default()));
        let empty = Vec::new;
        Self {
            subject,
            criterion,
            is_alone,
            par,
            factor: empty(),
            inverse_factor: empty(),
            matrix: empty(),
            scratch,
        }
    }

    pub(super) fn criterion(&self) -> Criterion {
        self.criterion
    }

    pub(super) fn n_points(&self) -> usize {
        self.subject.n_points()
    }

    /// The score at some hyperparameters; `None` where the matrix is not positive definite in float64, or the score is not finite.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`]; those of [`Hyperparameters::stretched`].
    pub(super) fn score(
        &mut self,
        at: &Hyperparameters,
        observer: &dyn Observer,
    ) -> Result<Option<State>, NumericsError> {
        let (cloud, kernel) = at.stretched(self.subject.cloud)?;
        if !self.factorize(&cloud, &kernel, &at.noise, observer)? {
            return Ok(None);
        }
        observer.checkpoint()?;
        let (n, p) = (self.subject.n_points(), self.subject.n_functions);
        let mut columns = self.whitened();
        if remove_mean(&mut columns, n, p).is_none() {
            return Ok(None);
        }
        let energy = dot(&columns[p * n..], &columns[p * n..]);
        let factor = MatRef::from_column_major_slice(&self.factor, n, n);
        let log_determinant = (0..n).map(|i| factor[(i, i)].ln()).sum::<f64>() * 2.0;
        let right = MatMut::from_column_major_slice_mut(&mut columns, n, p + 1);
        solve_upper_triangular_in_place(factor.transpose(), right, self.par);
        let weights = columns.split_off(p * n);
        let mut state = State {
            cloud,
            kernel,
            weights,
            of_mean: columns,
            diagonal: Vec::new(),
            relative_noise: relative_noise(&at.noise, n),
            energy,
            log_determinant,
            score: f64::NAN,
            has_inverse_factor: false,
        };
        if self.criterion.needs_diagonal() && !self.find_diagonal(&mut state) {
            return Ok(None);
        }
        state.score = self.criterion.score(&state.parts());
        Ok(state.score.is_finite().then_some(state))
    }

    /// Derivatives of the score in the logarithms of what is free, at the hyperparameters of the last score.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(super) fn gradient(
        &mut self,
        space: &Space,
        at: &Hyperparameters,
        state: &mut State,
        observer: &dyn Observer,
    ) -> Result<Vec<f64>, NumericsError> {
        if space.n_free() == 0 {
            return Ok(Vec::new());
        }
        let sensitivity = self.criterion.sensitivity(&state.parts());
        self.invert_factor(state);
        observer.checkpoint()?;
        self.multiply_inverse();
        let mut right = sensitivity.right;
        if let Some(of_columns) = &sensitivity.of_columns {
            right = self.projected(state, right);
            observer.checkpoint()?;
            self.multiply_columns(state, of_columns);
        }
        observer.checkpoint()?;
        let weights = PairWeights {
            matrix: &self.matrix,
            scale: sensitivity.scale,
            left: &state.weights,
            right: &right,
        };
        let kernel = (&state.cloud, &state.kernel);
        let sums = contract(kernel, &weights, space.per_axis(), self.is_alone, observer)?;
        Ok(space.gradient(at, &sums, weights.trace()))
    }

    /// The mean with its coefficients, `(FᵀWF)⁻¹FᵀWY`, after a score; `None` if there is none.
    pub(super) fn trend(&self) -> Option<Trend> {
        let (n, p) = (self.subject.n_points(), self.subject.n_functions);
        let columns = self.whitened();
        let column = |a: usize| &columns[a * n..][..n];
        let gram = Mat::from_fn(p, p, |a, b| dot(column(a), column(b)));
        let solved = solve_gram(&gram, Mat::from_fn(p, 1, |a, _| dot(column(a), column(p))))?;
        self.subject.trend((0..p).map(|a| solved[(a, 0)]).collect())
    }

    /// Whether `K + N = LLᵀ` in float64.
    fn factorize(
        &mut self,
        cloud: &Cloud,
        kernel: &Kernel,
        noise: &Regularization,
        observer: &dyn Observer,
    ) -> Result<bool, NumericsError> {
        let n = cloud.n_points();
        self.factor.resize(n * n, 0.0);
        match self.is_alone {
            false => fill_lower_gram(cloud, kernel, noise, &mut self.factor, n, observer)?,
            true => {
                let nodes = Nodes::of(cloud);
                for (j, column) in self.factor.chunks_exact_mut(n).enumerate() {
                    fill_kernel_column(&nodes, kernel, cloud.point(j), j..n, &mut column[j..]);
                    column[j] += noise.at(j);
                }
            }
        }
        let mut factor = MatMut::from_column_major_slice_mut(&mut self.factor, n, n);
        let stack = MemStack::new(&mut self.scratch);
        let params = Default::default();
        let made =
            llt::factor::cholesky_in_place(factor.rb_mut(), Default::default(), self.par, stack, params);
        let least = SMALLEST_PIVOT * kernel.at_zero();
        Ok(made.is_ok() && (0..n).all(|i| factor[(i, i)] * factor[(i, i)] > least))
    }

    /// `L⁻¹` times the functions of the mean and the values, `[n, p + 1]`.
    fn whitened(&self) -> Vec<f64> {
        let (n, p) = (self.subject.n_points(), self.subject.n_functions);
        let mut columns = self.subject.functions.clone();
        columns.extend_from_slice(&self.subject.values);
        let right = MatMut::from_column_major_slice_mut(&mut columns, n, p + 1);
        let factor = MatRef::from_column_major_slice(&self.factor, n, n);
        solve_lower_triangular_in_place(factor, right, self.par);
        columns
    }

    /// `P_ii = |L⁻¹e_i|² − |T_i|²`; false if one is not positive: then nothing but its value says what a point's value is.
    fn find_diagonal(&mut self, state: &mut State) -> bool {
        self.invert_factor(state);
        let n = self.subject.n_points();
        let entry = |(i, column): (usize, &[f64])| {
            let of_inverse = dot(&column[i..], &column[i..]);
            let of_mean: f64 = state.of_mean.chunks_exact(n).map(|t| t[i] * t[i]).sum();
            let left = of_inverse - of_mean;
            if left > UNDETERMINED * of_inverse { left } else { f64::NAN }
        };
        let columns = &self.inverse_factor;
        state.diagonal = match self.is_alone {
            false => columns.par_chunks_exact(n).enumerate().map(entry).collect(),
            true => columns.chunks_exact(n).enumerate().map(entry).collect(),
        };
        state.diagonal.iter().all(|p| p.is_finite())
    }

    fn invert_factor(&mut self, state: &mut State) {
        if state.has_inverse_factor {
            return;
        }
        let n = self.subject.n_points();
        self.inverse_factor.resize(n * n, 0.0);
        let inverse = MatMut::from_column_major_slice_mut(&mut self.inverse_factor, n, n);
        invert_lower_triangular(inverse, MatRef::from_column_major_slice(&self.factor, n, n), self.par);
        state.has_inverse_factor = true;
    }

    /// `M ← W = L⁻ᵀL⁻¹`.
    fn multiply_inverse(&mut self) {
        let n = self.subject.n_points();
        self.matrix.resize(n * n, 0.0);
        let inverse = MatRef::from_column_major_slice(&self.inverse_factor, n, n);
        triangular::matmul(
            MatMut::from_column_major_slice_mut(&mut self.matrix, n, n),
            BlockStructure::TriangularLower,
            Accum::Replace,
            inverse.transpose(),
            BlockStructure::TriangularUpper,
            inverse,
            BlockStructure::TriangularLower,
            1.0,
            self.par,
        );
    }

    /// `M ← P diag(c) P` from M = W, c not negative.
    fn multiply_columns(&mut self, state: &mut State, of_columns: &[f64]) {
        let n = self.subject.n_points();
        let (matrix, of_mean) = (&self.matrix, &state.of_mean);
        let fill = |(j, column): (usize, &mut [f64])| {
            let root = of_columns[j].sqrt();
            for (i, entry) in column.iter_mut().enumerate() {
                let (row, col) = (i.max(j), i.min(j));
                let of_mean: f64 = of_mean.chunks_exact(n).map(|t| t[i] * t[j]).sum();
                *entry = root * (matrix[col * n + row] - of_mean);
            }
        };
        match self.is_alone {
            false => self.inverse_factor.par_chunks_exact_mut(n).enumerate().for_each(fill),
            true => self.inverse_factor.chunks_exact_mut(n).enumerate().for_each(fill),
        }
        state.has_inverse_factor = false;
        let scaled = MatRef::from_column_major_slice(&self.inverse_factor, n, n);
        triangular::matmul(
            MatMut::from_column_major_slice_mut(&mut self.matrix, n, n),
            BlockStructure::TriangularLower,
            Accum::Replace,
            scaled,
            BlockStructure::Rectangular,
            scaled.transpose(),
            BlockStructure::Rectangular,
            1.0,
            self.par,
        );
    }

    /// `P` times a vector.
    fn projected(&self, state: &State, vector: Vec<f64>) -> Vec<f64> {
        let n = vector.len();
        let of_mean: Vec<f64> = state.of_mean.chunks_exact(n).map(|t| dot(t, &vector)).collect();
        let mut found = vector;
        let factor = MatRef::from_column_major_slice(&self.factor, n, n);
        let mut right = MatMut::from_column_major_slice_mut(&mut found, n, 1);
        solve_lower_triangular_in_place(factor, right.rb_mut(), self.par);
        solve_upper_triangular_in_place(factor.transpose(), right.rb_mut(), self.par);
        for (t, along) in state.of_mean.chunks_exact(n).zip(of_mean) {
            found.iter_mut().zip(t).for_each(|(entry, t)| *entry -= along * t);
        }
        found
    }
}

/// What the mean leaves of `W_ii` at least, as a share: less is rounding.
pub(super) const UNDETERMINED: f64 = 1e-12;

/// The refusal of hyperparameters with an α that is enough: `4nε‖K‖₁`, and `‖K‖₁` is `nv` at most.
pub(super) fn never_definite(at: &Hyperparameters, n: usize) -> NumericsError {
    let minimum_alpha = 4.0 * (n as f64).powi(2) * f64::EPSILON * at.variance;
    NumericsError::NotPositiveDefinite { reason: NotDefinite::Unfactorable, minimum_alpha }
}

/// The noise in units of its mean: 1 where it is the same everywhere, or nothing.
pub(super) fn relative_noise(noise: &Regularization, n: usize) -> Vec<f64> {
    match noise {
        Regularization::Uniform(_) => vec![1.0; n],
        Regularization::PerPoint(variances) => {
            let mean = variances.iter().sum::<f64>() / n as f64;
            if mean > 0.0 { variances.iter().map(|v| v / mean).collect() } else { vec![1.0; n] }
        }
    }
}

#[cfg(test)]
mod tests;
