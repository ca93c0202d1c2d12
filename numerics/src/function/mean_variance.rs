//! The part of variances that is due to the unknown mean.
//!
//! Take a functional with covariances c to the values, and with f its results on the mean's functions. Under
//! a flat prior on the coefficients of the mean, its variance grows by `hᵀ(FᵀWF)⁻¹h`, `h = f − FᵀWc`
//! (Rasmussen and Williams 2006, eq. 2.42).

use faer::{Mat, MatMut};

use crate::error::{NumericsError, Result};
use crate::machine::vector::dot;
use crate::observer::Unobserved;
use crate::solver::Solver;
use crate::solver::trend::{Basis, Trend, solve_gram};

/// The mean's part in variances, factored for many functionals.
pub(super) struct MeanVariance<'a> {
    pub(super) basis: &'a Basis,
    /// `L⁻¹F`, `[p, n]`: one column of n numbers per function.
    whitened: Vec<f64>,
    /// `(FᵀWF)⁻¹`, `[p, p]`.
    inverse: Mat<f64>,
    n_points: usize,
}

impl<'a> MeanVariance<'a> {
    /// # Errors
    /// [`NumericsError::NotPositiveDefinite`]
    /// without a Cholesky factor. [`NumericsError::MeanNotDetermined`].
    pub(super) fn of(solver: &Solver, trend: &'a Trend) -> Result<Self> {
        let (basis, n) = (trend.basis(), solver.n_points());
        let p = basis.n_functions();
        let mut whitened = basis.columns(solver.cloud());
        // Unobserved, since a few columns take no time.
        solver.whiten_in_place(MatMut::from_column_major_slice_mut(&mut whitened, n, p), &Unobserved)?;
        let gram = Mat::from_fn(p, p, |a, b| dot(&whitened[a * n..][..n], &whitened[b * n..][..n]));
        let inverse = solve_gram(&gram, Mat::identity(p, p)).ok_or(NumericsError::MeanNotDetermined)?;
        Ok(Self { basis, whitened, inverse, n_points: n })
    }

    /// Returns h of the value at position x. `column` is `L⁻¹c`, the whitened covariances of the value.
    pub(super) fn unexplained_at(&self, x: &[f64], column: &[f64]) -> Vec<f64> {
        let mut functions = vec![0.0; self.basis.n_functions()];
        self.basis.at(x, &mut functions);
        self.unexplained(functions, column)
    }

    /// Returns h of a functional from f, its results on the mean's functions, and from `column`, `L⁻¹c`.
    pub(super) fn unexplained(&self, mut functions: Vec<f64>, column: &[f64]) -> Vec<f64> {
        let whitened = self.whitened.chunks_exact(self.n_points);
        functions.iter_mut().zip(whitened).for_each(|(h, o)| *h -= dot(o, column));
        functions
    }

    /// Returns `gᵀ(FᵀWF)⁻¹h`.
    pub(super) fn product(&self, g: &[f64], h: &[f64]) -> f64 {
        (0..g.len()).map(|a| g[a] * (0..h.len()).map(|b| self.inverse[(a, b)] * h[b]).sum::<f64>()).sum()
    }
}
