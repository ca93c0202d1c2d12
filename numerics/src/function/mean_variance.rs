//! What not knowing the mean adds to variances.
//!
//! Under a flat prior on the coefficients of the mean the variance of a functional with covariances c to the values and `f` of the
//! mean's functions grows by `hᵀ(FᵀWF)⁻¹h`, `h = f − FᵀWc` (Rasmussen and Williams 2006, eq. 2.42).

use faer::{Mat, MatMut};

use crate::error::NumericsError;
use crate::machine::vector::dot;
use crate::observer::Unobserved;
use crate::solver::Solver;
use crate::solver::trend::{Basis, Trend, solve_gram};

/// The mean's part in variances.
pub(super) struct MeanVariance<'a> {
    pub(super) basis: &'a Basis,
    /// `L⁻¹F`, one column for each function.
    whitened: Vec<f64>,
    /// `(FᵀWF)⁻¹`.
    inverse: Mat<f64>,
    n_points: usize,
}

impl<'a> MeanVariance<'a> {
    /// # Errors
    /// [`NumericsError::NotPositiveDefinite`] without a Cholesky factor, [`NumericsError::MeanNotDetermined`].
    pub(super) fn of(solver: &Solver, trend: &'a Trend) -> Result<Self, NumericsError> {
        let (basis, n) = (trend.basis(), solver.n_points());
        let p = basis.n_functions();
        let mut whitened = basis.columns(solver.cloud());
        // A handful of columns, which take a moment.
        solver.whiten_in_place(MatMut::from_column_major_slice_mut(&mut whitened, n, p), &Unobserved)?;
        let gram = Mat::from_fn(p, p, |a, b| dot(&whitened[a * n..][..n], &whitened[b * n..][..n]));
        let inverse = solve_gram(&gram, Mat::identity(p, p)).ok_or(NumericsError::MeanNotDetermined)?;
        Ok(Self { basis, whitened, inverse, n_points: n })
    }

    /// h of the value at a position, from the whitened covariances there.
    pub(super) fn unexplained_at(&self, x: &[f64], column: &[f64]) -> Vec<f64> {
        let mut functions = vec![0.0; self.basis.n_functions()];
        self.basis.at(x, &mut functions);
        self.unexplained(functions, column)
    }

    /// h of a functional, from what it is on each function of the mean.
    pub(super) fn unexplained(&self, mut functions: Vec<f64>, column: &[f64]) -> Vec<f64> {
        let whitened = self.whitened.chunks_exact(self.n_points);
        functions.iter_mut().zip(whitened).for_each(|(h, o)| *h -= dot(o, column));
        functions
    }

    /// `gᵀ(FᵀWF)⁻¹h`.
    pub(super) fn product(&self, g: &[f64], h: &[f64]) -> f64 {
        (0..g.len()).map(|a| g[a] * (0..h.len()).map(|b| self.inverse[(a, b)] * h[b]).sum::<f64>()).sum()
    }
}
