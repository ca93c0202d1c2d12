//! Information of values about functionals: whitened covariances, and the determinant.

use faer::prelude::ReborrowMut;
use faer::{Mat, MatMut, Par};

use super::MAX_INVERSE_DIAGONAL;
use super::dense::{Cholesky, pieces};
use super::factorized::{Factorization, Solver};
use super::solution::MAX_RELATIVE_RESIDUAL;
use crate::error::{NotDefinite, NumericsError, Quantity, Result, SolverKind};
use crate::machine::vector::dot;
use crate::observer::Observer;
use crate::points::cloud::Cloud;

/// Whitened columns.
///
/// The first rows of a column count as explained, the others as not: the products of the latter are
/// subtracted.
pub(crate) struct WhitenedColumns {
    pub(crate) columns: Vec<f64>,
    pub(crate) n_rows: usize,
    pub(crate) n_explaining: usize,
}

impl WhitenedColumns {
    /// Columns of two halves, `[2 half, k]`, of which the first ones count as explained.
    fn in_halves(columns: Vec<f64>, half: usize) -> Self {
        Self { columns, n_rows: 2 * half, n_explaining: half }
    }

    /// The columns, one for each functional.
    pub(crate) fn iter(&self) -> std::slice::ChunksExact<'_, f64> {
        self.columns.chunks_exact(self.n_rows)
    }

    /// The covariance of two functionals that the values explain, from their columns.
    pub(crate) fn explained(&self, a: &[f64], b: &[f64]) -> f64 {
        let (n, own) = (self.n_explaining, |x: &[f64], y: &[f64]| dot(x, y));
        own(&a[..n], &b[..n]) - own(&a[n..], &b[n..])
    }
}

impl Solver {
    /// The points whose covariances with a functional determine its posterior.
    pub(crate) fn known_points(&self) -> &Cloud {
        match &self.factorization {
            Factorization::Landmark(landmarks) => landmarks.cloud(),
            Factorization::Cholesky(_)
            | Factorization::PivotedCholesky { .. }
            | Factorization::Iterative(_) => self.system.cloud(),
        }
    }

    /// Whitens covariances with the [`Solver::known_points`], one column for each functional: `L⁻¹` times
    /// them, `LLᵀ = K + αI`, or what stands for it. [`WhitenedColumns::explained`] is then the covariance
    /// that the values explain.
    ///
    /// # Errors
    /// [`NumericsError::NotPositiveDefinite`] where the matrix has no such factor in float64;
    /// [`NumericsError::Cancelled`].
    pub(crate) fn whitened(&self, covariances: Vec<f64>, observer: &dyn Observer) -> Result<WhitenedColumns> {
        let n = self.system.n_points();
        match &self.factorization {
            Factorization::Landmark(landmarks) => {
                Ok(WhitenedColumns::in_halves(landmarks.whitened(&covariances), landmarks.rank()))
            }
            Factorization::Iterative(iterative) => {
                Ok(WhitenedColumns::in_halves(iterative.whitened(&covariances, observer)?, n))
            }
            Factorization::Cholesky(_) | Factorization::PivotedCholesky { .. } => {
                let mut columns = covariances;
                let count = columns.len() / n;
                self.whiten_in_place(MatMut::from_column_major_slice_mut(&mut columns, n, count), observer)?;
                Ok(WhitenedColumns { columns, n_rows: n, n_explaining: n })
            }
        }
    }

    /// Whitens values `[n, k]` in the same way, such that [`WhitenedColumns::explained`] of them and
    /// covariances is what their fit predicts.
    ///
    /// # Errors
    /// Returns the errors of [`Solver::whitened`].
    pub(crate) fn whitened_values(
        &self,
        values: Vec<f64>,
        observer: &dyn Observer,
    ) -> Result<WhitenedColumns> {
        match &self.factorization {
            Factorization::Landmark(landmarks) => Ok(WhitenedColumns::in_halves(
                landmarks.whitened_values(&values, observer)?,
                landmarks.rank(),
            )),
            Factorization::Cholesky(_)
            | Factorization::PivotedCholesky { .. }
            | Factorization::Iterative(_) => self.whitened(values, observer),
        }
    }

    /// Magnitude of a negative variance up to which it is rounding, if that does not depend on the query.
    pub(crate) fn rounding_of_variances(&self) -> Option<f64> {
        match &self.factorization {
            Factorization::Landmark(landmarks) => Some(landmarks.remaining().max(landmarks.tolerance())),
            Factorization::Iterative(iterative) => Some(iterative.tolerance() * self.kernel().at_zero()),
            Factorization::Cholesky(_) | Factorization::PivotedCholesky { .. } => None,
        }
    }

    /// Overwrites the columns of `[n, k]` by `L⁻¹` times them, `LLᵀ = K + αI`.
    ///
    /// # Errors
    /// [`NumericsError::NotPositiveDefinite`] where the matrix has no such factor in float64;
    /// [`NumericsError::Cancelled`].
    pub(crate) fn whiten_in_place(
        &self,
        mut columns: MatMut<'_, f64>,
        observer: &dyn Observer,
    ) -> Result<()> {
        let (n, cholesky) = (self.system.n_points(), self.cholesky()?);
        for (first, count) in pieces(columns.ncols(), (n * n) as f64) {
            observer.checkpoint()?;
            cholesky.whiten_in_place(columns.rb_mut().subcols_mut(first, count));
        }
        Ok(())
    }

    /// The diagonal of `(K + αI)⁻¹`, `[n]`.
    ///
    /// # Errors
    /// Returns [`NumericsError::Unsupported`] for more than [`MAX_INVERSE_DIAGONAL`] points, and the errors
    /// of [`Solver::whiten_in_place`].
    pub(crate) fn inverse_diagonal(&self) -> Result<Vec<f64>> {
        let n = self.system.n_points();
        if n > MAX_INVERSE_DIAGONAL {
            let solver = SolverKind::Dense;
            return Err(NumericsError::Unsupported { solver, quantity: Quantity::InverseDiagonal });
        }
        let mut inverse = Mat::<f64>::identity(n, n);
        // On one thread: the caller is one of many tasks, and a thread that waits would begin another task of
        // that kind.
        self.cholesky()?.whiten_with(inverse.as_mut(), Par::Seq);
        Ok((0..n).map(|i| inverse.col(i).squared_norm_l2()).collect())
    }

    /// `ln det(K + αI)`.
    ///
    /// # Errors
    /// Returns the errors of [`Solver::whiten_in_place`], and [`NumericsError::Unsupported`] for a solver
    /// that does not know it.
    pub(crate) fn log_determinant(&self) -> Result<f64> {
        match &self.factorization {
            Factorization::Landmark(landmarks) => Ok(landmarks.log_determinant()),
            Factorization::Iterative(_) => {
                let (solver, quantity) = (SolverKind::Iterative, Quantity::Likelihood);
                Err(NumericsError::Unsupported { solver, quantity })
            }
            Factorization::Cholesky(_) | Factorization::PivotedCholesky { .. } => {
                Ok(self.cholesky()?.log_determinant())
            }
        }
    }

    /// Returns the Cholesky factor, unless the matrix is singular to rounding. A factor of such a matrix
    /// exists by luck. It still solves smooth right-hand sides, but its variances and determinants are off by
    /// tens of percent.
    fn cholesky(&self) -> Result<&Cholesky> {
        match &self.factorization {
            Factorization::Cholesky(factor) => match self.reciprocal_condition {
                Some(reciprocal_condition) if reciprocal_condition < f64::EPSILON => {
                    Err(self.not_positive_definite(NotDefinite::Singular { reciprocal_condition }))
                }
                _ => Ok(factor),
            },
            Factorization::PivotedCholesky { failed_at, .. } => {
                Err(self.not_positive_definite(NotDefinite::NeedsCholesky { point: *failed_at }))
            }
            Factorization::Landmark(_) => Err(without_factor(SolverKind::Landmark)),
            Factorization::Iterative(_) => Err(without_factor(SolverKind::Iterative)),
        }
    }

    /// Returns the refusal with its remedy: an α that is large enough.
    pub(crate) fn not_positive_definite(&self, reason: NotDefinite) -> NumericsError {
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

/// The refusal of what needs a factor of the whole matrix.
fn without_factor(solver: SolverKind) -> NumericsError {
    NumericsError::Unsupported { solver, quantity: Quantity::InverseDiagonal }
}
