//! The factorization of the whole matrix: Cholesky, and where that fails least squares on the pivots of a rank-revealing one.

mod cholesky;
mod factor;
mod packed;
mod pivoted_cholesky;
mod pivoting;
mod substitution;

use std::sync::Arc;

use faer::prelude::ReborrowMut;
use faer::{Mat, MatMut, Par};

use super::condition::estimate_norm1;
use super::solution::MAX_RELATIVE_RESIDUAL;
use super::system::System;
use crate::error::{NotDefinite, NumericsError};
use crate::machine::heap::{arc_payload, block_bytes, vec_bytes};
use crate::machine::pages::SpareBuffer;
use crate::observer::{Observer, Stage};
use crate::points::cloud::Cloud;
pub(crate) use cholesky::factorize_in_place;
use cholesky::{Cholesky, pieces};
pub use factor::{Factor, FactorBuilder};
use pivoted_cholesky::PivotedCholesky;

/// How `K + αI` was factorized.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// `K + αI = LLᵀ`, in place.
    Cholesky,
    /// Rank-revealing pivoted Cholesky and least squares on the pivots, where Cholesky fails in float64.
    PivotedCholesky,
}

/// Where a factorization has its memory from.
pub struct Workspace<'a> {
    /// The memory of an earlier factorization, if one was given back; this one's is when it is dropped.
    pub spare: &'a Arc<SpareBuffer>,
    /// Asked before the factorization takes more than half of the matrix, with the bytes that it then takes in all.
    pub may_take: &'a mut dyn FnMut(usize) -> bool,
}

/// A pivot of Cholesky up to this multiple of k₀ is rounding: it came out positive by luck, and the weights behind it are
/// noise that the residual hardly shows. Below `minimum_alpha`, which is at least 16 ε k₀ and enters a pivot twice where two
/// points coincide.
const SMALLEST_PIVOT: f64 = 16.0 * f64::EPSILON;

/// A factorization of `K(X, X) + αI` with the system that it was made from, so that it cannot be used with others.
pub struct Dense {
    system: System,
    factorization: Factorization,
    norm1: f64,
    reciprocal_condition: f64,
    /// The weights of the constant 1, `[n]`.
    weights_of_one: Vec<f64>,
}

enum Factorization {
    Cholesky(Cholesky),
    PivotedCholesky { factor: PivotedCholesky, failed_at: usize, pivots: Arc<Cloud> },
}

impl Dense {
    /// Numbers of the matrix at its peak, checked: half of it.
    pub(super) fn n_numbers_needed(n_points: usize) -> Option<usize> {
        Cholesky::n_numbers_needed(n_points)
    }

    /// Numbers at most, checked: all of the matrix for the fallback, where the rank is more than n/4, when Cholesky has failed
    /// and given its own back.
    pub(super) fn n_numbers_needed_at_most(n_points: usize) -> Option<usize> {
        Some(PivotedCholesky::n_numbers_needed(n_points)?.max(Self::n_numbers_needed(n_points)?))
    }

    /// Assembles and factorizes `K(X, X) + αI` exactly as given: no jitter is ever added.
    ///
    /// Cholesky in place; where a pivot is rounding, pivoted Cholesky to 64 ε k₀ and least squares on the pivots.
    ///
    /// # Errors
    /// [`NumericsError::OutOfMemory`], also if it needs more than it may take; [`NumericsError::Cancelled`].
    pub(super) fn factorize(
        workspace: Workspace<'_>,
        system: System,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        let (cloud, kernel, regularization) = (system.cloud(), system.kernel(), system.regularization());
        observer.enter(Stage::Gram);
        let gram = Cholesky::assemble(workspace.spare, cloud, kernel, regularization, observer)?;
        let norm1 = gram.norm1();
        observer.enter(Stage::Factor);
        let factorization = match gram.factorize(SMALLEST_PIVOT * kernel.at_zero(), observer)? {
            Ok(factor) => Factorization::Cholesky(factor),
            Err(failed_at) => {
                let n_numbers = Self::n_numbers_needed_at_most(cloud.n_points()).unwrap_or(usize::MAX);
                let may_take_all = || (workspace.may_take)(n_numbers.saturating_mul(size_of::<f64>()));
                let factor =
                    PivotedCholesky::factorize(cloud, kernel, regularization, may_take_all, observer)?;
                let pivots = Arc::new(cloud.select(factor.pivots()));
                Factorization::PivotedCholesky { factor, failed_at, pivots }
            }
        };
        observer.enter(Stage::Condition);
        let (inverse_norm1, weights_of_one) = estimate_norm1(
            cloud.n_points(),
            |x| factorization.solve_in_place(x),
            |x| factorization.solve_transposed_in_place(x),
        );
        let product = norm1 * inverse_norm1;
        let reciprocal_condition = if product.is_finite() { 1.0 / product.max(1.0) } else { 0.0 };
        Ok(Self { system, factorization, norm1, reciprocal_condition, weights_of_one })
    }

    pub(super) fn system(&self) -> &System {
        &self.system
    }

    pub(super) fn method(&self) -> Method {
        match self.factorization {
            Factorization::Cholesky(_) => Method::Cholesky,
            Factorization::PivotedCholesky { .. } => Method::PivotedCholesky,
        }
    }

    /// Numerical rank: n for Cholesky, the number of pivots for the fallback.
    pub(super) fn rank(&self) -> usize {
        match &self.factorization {
            Factorization::Cholesky(_) => self.system.n_points(),
            Factorization::PivotedCholesky { factor, .. } => factor.pivots().len(),
        }
    }

    /// `1/(‖K + αI‖₁ ‖W‖₁)` where W maps values to weights, estimated from the factor (Higham 2002, alg. 15.1).
    pub(super) fn reciprocal_condition(&self) -> f64 {
        self.reciprocal_condition
    }

    /// `W·1`, `[n]`: where the estimate of the condition begins.
    pub(super) fn weights_of_one(&self) -> &[f64] {
        &self.weights_of_one
    }

    /// `‖K + αI‖₁`.
    pub(super) fn norm1(&self) -> f64 {
        self.norm1
    }

    /// The points with weights, and which of X they are where they are not all.
    pub(super) fn centres(&self) -> (&Cloud, Option<&[usize]>) {
        match &self.factorization {
            Factorization::Cholesky(_) => (self.system.cloud(), None),
            Factorization::PivotedCholesky { factor, pivots, .. } => (pivots, Some(factor.pivots())),
        }
    }

    /// Bytes held on the heap.
    pub(super) fn n_bytes(&self) -> usize {
        let factor = match &self.factorization {
            Factorization::Cholesky(factor) => factor.n_bytes(),
            Factorization::PivotedCholesky { factor, pivots, .. } => {
                factor.n_bytes() + block_bytes(arc_payload::<Cloud>()) + pivots.n_bytes()
            }
        };
        factor + vec_bytes(&self.weights_of_one) + self.system.n_bytes()
    }

    /// Overwrites the columns of `[n, k]` values by weights, `Λ = W Y` with `W = (K + αI)⁻¹` (its least-squares
    /// substitute for the fallback).
    pub(super) fn solve_in_place(&self, values: MatMut<'_, f64>) {
        self.factorization.solve_in_place(values);
    }

    /// Overwrites the columns of `[n, k]` by `Wᵀ` times them.
    pub(super) fn solve_transposed_in_place(&self, functionals: MatMut<'_, f64>) {
        self.factorization.solve_transposed_in_place(functionals);
    }

    /// Overwrites the columns of `[n, k]` by `L⁻¹` times them.
    ///
    /// # Errors
    /// [`NumericsError::NotPositiveDefinite`] if there is no Cholesky factor; [`NumericsError::Cancelled`].
    pub(super) fn whiten_in_place(
        &self,
        mut columns: MatMut<'_, f64>,
        observer: &dyn Observer,
    ) -> Result<(), NumericsError> {
        let (n, cholesky) = (self.system.n_points(), self.cholesky()?);
        for (first, count) in pieces(columns.ncols(), (n * n) as f64) {
            observer.checkpoint()?;
            cholesky.whiten_in_place(columns.rb_mut().subcols_mut(first, count));
        }
        Ok(())
    }

    /// The diagonal of `(K + αI)⁻¹`, `Σ_k (L⁻¹)_ki²`: n³ flops and another n² numbers.
    ///
    /// # Errors
    /// [`NumericsError::NotPositiveDefinite`] if there is no Cholesky factor.
    pub(super) fn inverse_diagonal(&self) -> Result<Vec<f64>, NumericsError> {
        let n = self.system.n_points();
        let mut inverse = Mat::<f64>::identity(n, n);
        // On one thread: who asks for it is one of many tasks, and a thread that waits would take up another that asks as well.
        self.cholesky()?.whiten_with(inverse.as_mut(), Par::Seq);
        Ok((0..n).map(|i| inverse.col(i).squared_norm_l2()).collect())
    }

    /// `ln det(K + αI)`.
    ///
    /// # Errors
    /// [`NumericsError::NotPositiveDefinite`] if there is no Cholesky factor.
    pub(super) fn log_determinant(&self) -> Result<f64, NumericsError> {
        Ok(self.cholesky()?.log_determinant())
    }

    /// The Cholesky factor, unless the matrix is singular to rounding: such a factor exists by luck, still solves smooth
    /// right-hand sides, but variances and determinants from it are off by tens of percent.
    fn cholesky(&self) -> Result<&Cholesky, NumericsError> {
        match &self.factorization {
            Factorization::Cholesky(_) if self.reciprocal_condition < f64::EPSILON => {
                let reciprocal_condition = self.reciprocal_condition;
                Err(self.not_positive_definite(NotDefinite::Singular { reciprocal_condition }))
            }
            Factorization::Cholesky(factor) => Ok(factor),
            Factorization::PivotedCholesky { failed_at, .. } => {
                Err(self.not_positive_definite(NotDefinite::NeedsCholesky { point: *failed_at }))
            }
        }
    }

    /// The refusal with its remedy: an α for which Cholesky is sure to succeed in float64, `4 n ε ‖K‖₁`, and, where the
    /// residual was too large, one for which `ε ‖K‖₁ ‖Λ‖ ≤ ε ‖K‖₁ ‖Y‖/α` is small enough for any values.
    pub(super) fn not_positive_definite(&self, reason: NotDefinite) -> NumericsError {
        let multiple = match reason {
            NotDefinite::Residual { .. } => (self.system.n_points() as f64).max(1.0 / MAX_RELATIVE_RESIDUAL),
            NotDefinite::BackwardError { .. }
            | NotDefinite::NeedsCholesky { .. }
            | NotDefinite::Unfactorable
            | NotDefinite::Singular { .. }
            | NotDefinite::NegativeVariance { .. } => self.system.n_points() as f64,
        };
        NumericsError::NotPositiveDefinite {
            reason,
            minimum_alpha: 4.0 * multiple * f64::EPSILON * self.norm1,
        }
    }
}

impl Factorization {
    fn solve_in_place(&self, values: MatMut<'_, f64>) {
        match self {
            Self::Cholesky(factor) => factor.solve_in_place(values),
            Self::PivotedCholesky { factor, .. } => factor.solve_in_place(values),
        }
    }

    fn solve_transposed_in_place(&self, functionals: MatMut<'_, f64>) {
        match self {
            Self::Cholesky(factor) => factor.solve_in_place(functionals),
            Self::PivotedCholesky { factor, .. } => factor.solve_transposed_in_place(functionals),
        }
    }
}
