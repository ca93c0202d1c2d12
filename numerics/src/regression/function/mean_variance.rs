//! The part of variances that is due to the unknown mean.
//!
//! Take a functional with covariances c to the values, and with f its results on the mean's functions. Under
//! a flat prior on the coefficients of the mean, its variance grows by `hᵀ(FᵀWF)⁻¹h`, `h = f − FᵀWc`
//! (Rasmussen and Williams 2006, eq. 2.42).

use faer::{Mat, MatMut};

use crate::error::{NumericsError, Result};
use crate::machine::vector::dot;
use crate::observer::Observer;
use crate::regression::solver::trend::{Basis, Trend, solve_gram};
use crate::regression::solver::{Solver, WhitenedColumns};

/// The mean's part in variances, factored for many functionals.
pub(super) struct MeanVariance<'a> {
    pub(super) basis: &'a Basis,
    /// `L⁻¹F`: one column for each function.
    whitened: WhitenedColumns,
    /// `(FᵀWF)⁻¹`, `[p, p]`.
    inverse: Mat<f64>,
}

impl<'a> MeanVariance<'a> {
    /// # Errors
    /// [`NumericsError::NotPositiveDefinite`] without a Cholesky factor.
    /// [`NumericsError::MeanNotDetermined`], [`NumericsError::Cancelled`].
    pub(super) fn of(solver: &Solver, trend: &'a Trend, observer: &dyn Observer) -> Result<Self> {
        let (basis, n) = (trend.basis(), solver.n_points());
        let p = basis.n_functions();
        let columns = basis.columns(solver.cloud());
        let whitened = solver.whitened_values(columns.clone(), observer)?;
        let mut weights = columns.clone();
        solver.solve_in_place(MatMut::from_column_major_slice_mut(&mut weights, n, p), observer)?;
        let gram = Mat::from_fn(p, p, |a, b| dot(&columns[a * n..][..n], &weights[b * n..][..n]));
        let inverse = solve_gram(&gram, Mat::identity(p, p)).ok_or(NumericsError::MeanNotDetermined)?;
        Ok(Self { basis, whitened, inverse })
    }

    /// Returns h of the value at position x. `column` is `L⁻¹c`, the whitened covariances of the value.
    pub(super) fn unexplained_at(&self, x: &[f64], column: &[f64]) -> Vec<f64> {
        let mut functions = vec![0.0; self.basis.n_functions()];
        self.basis.at(x, &mut functions);
        self.unexplained(functions, column)
    }

    /// Returns h of a functional from f, its results on the mean's functions, and from `column`, `L⁻¹c`.
    pub(super) fn unexplained(&self, mut functions: Vec<f64>, column: &[f64]) -> Vec<f64> {
        let whitened = &self.whitened;
        functions.iter_mut().zip(whitened.iter()).for_each(|(h, o)| *h -= whitened.explained(o, column));
        functions
    }

    /// Returns `gᵀ(FᵀWF)⁻¹h`.
    pub(super) fn product(&self, g: &[f64], h: &[f64]) -> f64 {
        (0..g.len()).map(|a| g[a] * (0..h.len()).map(|b| self.inverse[(a, b)] * h[b]).sum::<f64>()).sum()
    }
}
