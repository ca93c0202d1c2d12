//! The factorization of `K + αI` and the verbs it offers: solve, apply transposed, evaluate, whiten, diagnostics.

mod cholesky;
mod condition;
mod packed;
mod pivoted_cholesky;
mod pivoting;
mod solution;
mod substitution;

use std::sync::Arc;

use faer::{Mat, MatMut, Par};

use super::error::{NotDefinite, NumericsError};
use super::kernel::Kernel;
use super::observer::{Observer, Stage};
use crate::numerics::machine::heap::{arc_payload, block_bytes, vec_bytes};
use crate::numerics::machine::pages::SpareBuffer;
use crate::numerics::points::cloud::Cloud;
use crate::numerics::points::duplicates::coinciding_points;
use crate::numerics::sums::regularization::Regularization;
pub use solution::Solution;

use cholesky::Cholesky;
use condition::estimate_norm1;
use pivoted_cholesky::PivotedCholesky;
use solution::MAX_RELATIVE_RESIDUAL;

/// How `K + αI` was factorized.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// `K + αI = LLᵀ`, in place.
    Cholesky,
    /// Rank-revealing pivoted Cholesky and least squares on the pivots, where Cholesky fails in float64.
    PivotedCholesky,
}

/// A factorization of `K(X, X) + αI`: the asset that everything is served from.
///
/// It keeps the cloud, kernel and regularization it was made from, so that it cannot be used with others.
pub struct GramFactor {
    cloud: Arc<Cloud>,
    kernel: Kernel,
    regularization: Regularization,
    factorization: Factorization,
    norm1: f64,
    reciprocal_condition: f64,
    /// The weights of the constant 1.
    weights_of_one: Vec<f64>,
}

/// Where a factorization has its memory from.
pub struct Workspace<'a> {
    /// The memory of an earlier factorization, if one was given back; this one's is when it is dropped.
    pub spare: &'a Arc<SpareBuffer>,
    /// Asked before the factorization takes more than [`GramFactor::n_bytes_needed`], with what it then takes in all.
    pub may_take: &'a mut dyn FnMut(usize) -> bool,
}

enum Factorization {
    Cholesky(Cholesky),
    PivotedCholesky { factor: PivotedCholesky, failed_at: usize },
}

impl GramFactor {
    /// Bytes that a factorization of n points needs at its peak, checked: half an n×n buffer. O(n) numbers per thread come on
    /// top.
    pub fn n_bytes_needed(n_points: usize) -> Option<usize> {
        Cholesky::n_numbers_needed(n_points)?.checked_mul(size_of::<f64>())
    }

    /// Bytes that it needs at most, checked: a whole n×n buffer for the fallback, where the rank is more than n/4, when Cholesky
    /// has failed and given its own back.
    pub fn n_bytes_needed_at_most(n_points: usize) -> Option<usize> {
        let fallback = PivotedCholesky::n_numbers_needed(n_points)?.checked_mul(size_of::<f64>())?;
        Some(fallback.max(Self::n_bytes_needed(n_points)?))
    }

    /// Flops that a factorization of n points takes unless Cholesky fails: n³/3.
    pub fn flops_expected(n_points: usize) -> f64 {
        (n_points as f64).powi(3) / 3.0
    }

    /// Flops that it takes at most: n³/3 for Cholesky, and where that fails up to 0.54 n³ for the fallback (at rank 2n/3).
    pub fn flops_needed(n_points: usize) -> f64 {
        (n_points as f64).powi(3)
    }

    /// Assembles and factorizes `K(X, X) + αI` exactly as given: no jitter is ever added.
    ///
    /// Cholesky in place; where a pivot is rounding, pivoted Cholesky to 64 ε k₀ and least squares on the pivots.
    ///
    /// # Errors
    /// [`NumericsError::KernelNotPositiveDefinite`] in this dimension, [`NumericsError::LengthMismatch`] of noise
    /// variances, [`NumericsError::DuplicatePoints`] where two coinciding points have no regularization,
    /// [`NumericsError::OutOfMemory`], [`NumericsError::Cancelled`].
    pub fn factorize(
        cloud: Arc<Cloud>,
        kernel: Kernel,
        regularization: Regularization,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        let (spare, mut may_take) = (SpareBuffer::up_to(0), |_| true);
        let workspace = Workspace { spare: &spare, may_take: &mut may_take };
        Self::factorize_in(workspace, cloud, kernel, regularization, observer)
    }

    /// [`GramFactor::factorize`] in memory that is somebody's to give.
    ///
    /// # Errors
    /// Those of [`GramFactor::factorize`]; [`NumericsError::OutOfMemory`] also if it needs more than it may take.
    pub fn factorize_in(
        workspace: Workspace<'_>,
        cloud: Arc<Cloud>,
        kernel: Kernel,
        regularization: Regularization,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        kernel.check_dimension(cloud.dimension())?;
        regularization.check_matches(&cloud)?;
        let twins = coinciding_points(&cloud, |point| regularization.at(point) == 0.0);
        if !twins.is_empty() {
            return Err(NumericsError::DuplicatePoints { points: twins });
        }
        observer.enter(Stage::Gram);
        let gram = Cholesky::assemble(workspace.spare, &cloud, &kernel, &regularization, observer)?;
        let norm1 = gram.norm1();
        observer.enter(Stage::Factor);
        let factorization = match gram.factorize(SMALLEST_PIVOT * kernel.at_zero(), observer)? {
            Ok(factor) => Factorization::Cholesky(factor),
            Err(failed_at) => {
                let n_bytes = Self::n_bytes_needed_at_most(cloud.n_points())
                    .ok_or(NumericsError::OutOfMemory { n_bytes: usize::MAX })?;
                let may_take_all = || (workspace.may_take)(n_bytes);
                let factor =
                    PivotedCholesky::factorize(&cloud, &kernel, &regularization, may_take_all, observer)?;
                Factorization::PivotedCholesky { factor, failed_at }
            }
        };
        observer.enter(Stage::Condition);
        let mut this = Self {
            cloud,
            kernel,
            regularization,
            factorization,
            norm1,
            reciprocal_condition: 0.0,
            weights_of_one: Vec::new(),
        };
        let (inverse_norm1, weights_of_one) = estimate_norm1(
            this.n_points(),
            |x| this.solve_in_place(x),
            |x| {
                this.solve_transposed_in_place(x);
            },
        );
        this.weights_of_one = weights_of_one;
        let product = norm1 * inverse_norm1;
        this.reciprocal_condition = if product.is_finite() { 1.0 / product.max(1.0) } else { 0.0 };
        Ok(this)
    }

    pub fn cloud(&self) -> &Cloud {
        &self.cloud
    }

    pub fn kernel(&self) -> &Kernel {
        &self.kernel
    }

    pub fn regularization(&self) -> &Regularization {
        &self.regularization
    }

    pub fn n_points(&self) -> usize {
        self.cloud.n_points()
    }

    pub fn method(&self) -> Method {
        match self.factorization {
            Factorization::Cholesky(_) => Method::Cholesky,
            Factorization::PivotedCholesky { .. } => Method::PivotedCholesky,
        }
    }

    /// Numerical rank: n for Cholesky, the number of pivots for the fallback.
    pub fn rank(&self) -> usize {
        match &self.factorization {
            Factorization::Cholesky(_) => self.n_points(),
            Factorization::PivotedCholesky { factor, .. } => factor.rank(),
        }
    }

    /// `1/(‖K + αI‖₁ ‖W‖₁)` where W maps values to weights, estimated from the factor (Higham 2002, alg. 15.1).
    pub fn reciprocal_condition(&self) -> f64 {
        self.reciprocal_condition
    }

    /// `W·1`, `[n]`: the weights of the signature function, where the estimate of the condition begins.
    pub(crate) fn weights_of_one(&self) -> &[f64] {
        &self.weights_of_one
    }

    /// `‖K + αI‖₁`.
    pub(crate) fn norm1(&self) -> f64 {
        self.norm1
    }

    /// Bytes held on the heap, those of the cloud included: the factor may outlive whoever shares it.
    pub fn n_bytes(&self) -> usize {
        let factor = match &self.factorization {
            Factorization::Cholesky(factor) => factor.n_bytes(),
            Factorization::PivotedCholesky { factor, .. } => factor.n_bytes(),
        };
        let noise = match &self.regularization {
            Regularization::Uniform(_) => 0,
            Regularization::PerPoint(variances) => vec_bytes(variances),
        };
        factor
            + noise
            + vec_bytes(&self.weights_of_one)
            + block_bytes(arc_payload::<Cloud>())
            + self.cloud.n_bytes()
    }

    /// Overwrites the columns of `[n, k]` values by weights, `Λ = W Y` with `W = (K + αI)⁻¹` (its least-squares
    /// substitute for the fallback).
    pub(crate) fn solve_in_place(&self, values: MatMut<'_, f64>) {
        match &self.factorization {
            Factorization::Cholesky(factor) => factor.solve_in_place(values),
            Factorization::PivotedCholesky { factor, .. } => factor.solve_in_place(values),
        }
    }

    /// Overwrites the columns of `[n, k]` by `Wᵀ` times them: turns functionals of the weights into functionals of the
    /// values, which is how operators become matrices.
    pub(crate) fn solve_transposed_in_place(&self, functionals: MatMut<'_, f64>) {
        match &self.factorization {
            Factorization::Cholesky(factor) => factor.solve_in_place(functionals),
            Factorization::PivotedCholesky { factor, .. } => factor.solve_transposed_in_place(functionals),
        }
    }

    /// Overwrites the columns of `[n, k]` by `L⁻¹` times them.
    ///
    /// # Errors
    /// [`NumericsError::NotPositiveDefinite`] if there is no Cholesky factor.
    pub(crate) fn whiten_in_place(&self, columns: MatMut<'_, f64>) -> Result<(), NumericsError> {
        self.cholesky()?.whiten_in_place(columns);
        Ok(())
    }

    /// The diagonal of `(K + αI)⁻¹`, `Σ_k (L⁻¹)_ki²`; `None` without a Cholesky factor. n³ flops and another n² numbers.
    pub(crate) fn inverse_diagonal(&self) -> Option<Vec<f64>> {
        let n = self.n_points();
        let mut inverse = Mat::<f64>::identity(n, n);
        self.cholesky().ok()?.whiten_in_place(inverse.as_mut());
        Some((0..n).map(|i| inverse.col(i).squared_norm_l2()).collect())
    }

    /// `ln det(K + αI)`.
    ///
    /// # Errors
    /// [`NumericsError::NotPositiveDefinite`] if there is no Cholesky factor.
    pub(crate) fn log_determinant(&self) -> Result<f64, NumericsError> {
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
    pub(crate) fn not_positive_definite(&self, reason: NotDefinite) -> NumericsError {
        let multiple = match reason {
            NotDefinite::Residual { .. } => (self.n_points() as f64).max(1.0 / MAX_RELATIVE_RESIDUAL),
            NotDefinite::BackwardError { .. }
            | NotDefinite::NeedsCholesky { .. }
            | NotDefinite::Singular { .. }
            | NotDefinite::NegativeVariance { .. } => self.n_points() as f64,
        };
        NumericsError::NotPositiveDefinite {
            reason,
            minimum_alpha: 4.0 * multiple * f64::EPSILON * self.norm1,
        }
    }
}

/// A pivot of Cholesky up to this multiple of k₀ is rounding: it came out positive by luck, and the weights behind it are
/// noise that the residual hardly shows. Below `minimum_alpha`, which is at least 16 ε k₀ and enters a pivot twice where two
/// points coincide.
const SMALLEST_PIVOT: f64 = 16.0 * f64::EPSILON;

/// Flops below which waking other threads costs more than it gains.
const SEQUENTIAL_FLOPS: f64 = 1e6;

/// The parallelism for a piece of work, in the rayon pool of the calling thread.
pub(crate) fn parallelism(flops: f64) -> Par {
    let n_threads = rayon::current_num_threads();
    if n_threads == 1 || flops < SEQUENTIAL_FLOPS { Par::Seq } else { Par::rayon(n_threads) }
}

#[cfg(test)]
mod tests;
