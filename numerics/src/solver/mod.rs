//! Solvers of `(K + αI) Λ = Y`: systems prepared so that weights for values are cheap.

pub(crate) mod price;
pub mod system;
pub mod trend;

mod condition;
mod dense;
mod many;
mod residuals;
mod solution;

use std::sync::Arc;

use faer::MatMut;

use super::error::{NotDefinite, NumericsError, Quantity, Result, SolverKind};
use super::kernel::Kernel;
use super::machine::pages::SpareBuffer;
use super::observer::Observer;
use super::points::cloud::Cloud;
use super::sums::expansion::Expansion;
use super::sums::regularization::Regularization;
pub(crate) use condition::estimate_norm1;
use dense::Dense;
pub use dense::{Factor, FactorBuilder, Method, Workspace};
pub(crate) use dense::{PIVOT_TOLERANCE, SMALLEST_PIVOT, factorize_in_place};
pub use residuals::{Disagreement, Outlier, Place};
pub(crate) use solution::MAX_RELATIVE_RESIDUAL;
pub use solution::Solution;
pub use system::System;

/// A system prepared for solving. It keeps the system, so that it cannot be used with another.
///
/// This is an enum and no trait, because the set is closed and the store needs sized values of known bytes.
/// An operation that a solver lacks is an arm of a match.
pub enum Solver {
    /// A factorization of the whole matrix.
    Dense(Box<Dense>),
}

/// Number of points up to which the diagonal of the inverse is computed. It costs three factorizations.
pub(crate) const MAX_INVERSE_DIAGONAL: usize = 512;

impl Solver {
    /// Factorizes the whole matrix, in memory of its own.
    ///
    /// # Errors
    /// [`NumericsError::OutOfMemory`], [`NumericsError::Cancelled`].
    pub fn dense(system: System, observer: &dyn Observer) -> Result<Self> {
        let (spare, mut may_take) = (SpareBuffer::up_to(0), |_| true);
        Self::dense_in(Workspace { spare: &spare, may_take: &mut may_take }, system, observer)
    }

    /// Factorizes the whole matrix in memory that `workspace` grants.
    ///
    /// # Errors
    /// Returns the errors of [`Solver::dense`], and [`NumericsError::OutOfMemory`] also if it needs more than
    /// it may take.
    pub fn dense_in(workspace: Workspace<'_>, system: System, observer: &dyn Observer) -> Result<Self> {
        Dense::factorize(workspace, system, observer).map(|dense| Self::Dense(Box::new(dense)))
    }

    /// Returns the factor for storage elsewhere, or `None` if the fallback took its place.
    pub fn factor(&self) -> Option<Factor<'_>> {
        self.as_dense().factor()
    }

    /// Restores a solver from its [`Factor`]. Returns `None` unless that is complete and has the size of the
    /// system.
    pub fn restore(
        factor: FactorBuilder,
        system: System,
        weights_of_one: Vec<f64>,
        norm1: f64,
        reciprocal_condition: f64,
    ) -> Option<Self> {
        let dense = factor.finish(system, weights_of_one, norm1, reciprocal_condition)?;
        Some(Self::Dense(Box::new(dense)))
    }

    fn as_dense(&self) -> &Dense {
        let Self::Dense(dense) = self;
        dense
    }

    pub fn system(&self) -> &System {
        self.as_dense().system()
    }

    pub fn cloud(&self) -> &Arc<Cloud> {
        self.system().cloud()
    }

    pub fn kernel(&self) -> &Kernel {
        self.system().kernel()
    }

    pub fn regularization(&self) -> &Regularization {
        self.system().regularization()
    }

    pub fn n_points(&self) -> usize {
        self.system().n_points()
    }

    /// Method by which the matrix was factorized.
    pub fn method(&self) -> Method {
        self.as_dense().method()
    }

    /// Numerical rank: n, or the number of pivots of the fallback.
    pub fn rank(&self) -> usize {
        self.as_dense().rank()
    }

    /// `1/(‖K + αI‖₁ ‖W‖₁)` where W maps values to weights, estimated (Higham 2002, alg. 15.1).
    pub fn reciprocal_condition(&self) -> f64 {
        self.as_dense().reciprocal_condition()
    }

    /// Bytes held on the heap, including those of the cloud.
    pub fn n_bytes(&self) -> usize {
        size_of::<Dense>() + self.as_dense().n_bytes()
    }

    /// Returns the function with given weights, one for each of its centres.
    pub(crate) fn expansion<'a>(&'a self, weights: &'a [f64]) -> Expansion<'a> {
        let (centres, _) = self.as_dense().centres();
        Expansion { centres, kernel: self.kernel(), weights }
    }

    /// Restricts weights at all points, `[n]`, to weights of the centres, `[r]`.
    fn at_centres(&self, weights: &[f64]) -> Vec<f64> {
        match self.as_dense().centres() {
            (_, None) => weights.to_vec(),
            (_, Some(points)) => points.iter().map(|&point| weights[point]).collect(),
        }
    }

    /// `W·1`, `[n]`: the weights of the signature function.
    fn weights_of_one(&self) -> &[f64] {
        self.as_dense().weights_of_one()
    }

    /// `‖K + αI‖₁`.
    pub(crate) fn norm1(&self) -> f64 {
        self.as_dense().norm1()
    }

    /// Overwrites the columns of `[n, k]` values by weights at all points, `Λ = W Y`.
    pub(crate) fn solve_in_place(&self, values: MatMut<'_, f64>) {
        self.as_dense().solve_in_place(values);
    }

    /// Overwrites the columns of `[n, k]` by `Wᵀ` times them.
    ///
    /// This turns functionals of the weights into functionals of the values, so that operators become
    /// matrices.
    pub(crate) fn solve_transposed_in_place(&self, functionals: MatMut<'_, f64>) {
        self.as_dense().solve_transposed_in_place(functionals);
    }

    /// Overwrites the columns of `[n, k]` by `L⁻¹` times them, `LLᵀ = K + αI`.
    ///
    /// # Errors
    /// [`NumericsError::NotPositiveDefinite`] where the matrix has no such factor in float64;
    /// [`NumericsError::Cancelled`].
    pub(crate) fn whiten_in_place(&self, columns: MatMut<'_, f64>, observer: &dyn Observer) -> Result<()> {
        self.as_dense().whiten_in_place(columns, observer)
    }

    /// The diagonal of `(K + αI)⁻¹`, `[n]`.
    ///
    /// # Errors
    /// Returns [`NumericsError::Unsupported`] for more than [`MAX_INVERSE_DIAGONAL`] points, and the errors
    /// of [`Solver::whiten_in_place`].
    pub(crate) fn inverse_diagonal(&self) -> Result<Vec<f64>> {
        if self.n_points() > MAX_INVERSE_DIAGONAL {
            let solver = SolverKind::Dense;
            return Err(NumericsError::Unsupported { solver, quantity: Quantity::InverseDiagonal });
        }
        self.as_dense().inverse_diagonal()
    }

    /// `ln det(K + αI)`.
    ///
    /// # Errors
    /// Returns the errors of [`Solver::whiten_in_place`].
    pub(crate) fn log_determinant(&self) -> Result<f64> {
        self.as_dense().log_determinant()
    }

    /// Returns the refusal with its remedy: an α that is large enough.
    pub(crate) fn not_positive_definite(&self, reason: NotDefinite) -> NumericsError {
        self.as_dense().not_positive_definite(reason)
    }
}

#[cfg(test)]
mod tests;
