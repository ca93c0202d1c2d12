//! The fallback where `K + αI` is not positive definite in float64: least squares on the pivots of a rank-revealing
//! Cholesky factorization.

use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Mat, MatMut, MatRef};
use rayon::prelude::*;

use crate::numerics::cloud::Cloud;
use crate::numerics::error::NumericsError;
use crate::numerics::gram::fill_cross_gram;
use crate::numerics::kernel::Kernel;
use crate::numerics::nodes::Nodes;
use crate::numerics::observer::Observer;
use crate::numerics::regularization::Regularization;

/// Pivots below this multiple of ε k₀ are rounding (numerics.md, Fit 2).
const PIVOT_TOLERANCE: f64 = 64.0 * f64::EPSILON;

/// Rows of the new column that one task updates: they stay in the L1 cache while all earlier columns pass by.
const ROWS_PER_TASK: usize = 1024;

/// `K ≈ LLᵀ` with r columns, and the map from values to weights on the r pivots Z.
///
/// With `u = Σ_j b_j k(·, z_j)` and `K(X, Z) = L L₁₁ᵀ` the coefficients `c = L₁₁ᵀ b` solve the least squares problem
/// `min |S(Lc − Y)|² + ρ²|c|²`, done by QR since the normal equations would lose half the digits; |c| is the norm of u, so
/// ρ² is the regularization. S weighs the points when their noise differs.
pub(super) struct PivotedCholesky {
    pivots: Vec<usize>,
    /// The first n rows of the thin Q of `[S L; ρI]`, times S: `[n, r]`.
    weighted_q: Mat<f64>,
    /// `[r, r]`, upper triangular.
    r: Mat<f64>,
    /// Rows of L at the pivots, `[r, r]`, lower triangular.
    l11: Mat<f64>,
}

impl PivotedCholesky {
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(super) fn factorize(
        cloud: &Cloud,
        kernel: &Kernel,
        regularization: &Regularization,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        let (pivots, columns) = pivoted_columns(cloud, kernel, observer)?;
        let (n, rank) = (cloud.n_points(), pivots.len());
        let l = MatRef::from_column_major_slice(&columns, n, rank);
        let l11 = Mat::from_fn(rank, rank, |i, j| if j <= i { l[(pivots[i], j)] } else { 0.0 });
        let (row_weights, ridge) = least_squares_weights(regularization, kernel, n);
        let n_rows = if ridge > 0.0 { n + rank } else { n };
        let augmented = Mat::from_fn(n_rows, rank, |i, j| match i.checked_sub(n) {
            None => row_weights[i] * l[(i, j)],
            Some(row) if row == j => ridge,
            Some(_) => 0.0,
        });
        drop(columns);
        observer.checkpoint()?;
        let qr = augmented.qr();
        let q = qr.compute_thin_Q();
        let weighted_q = Mat::from_fn(n, rank, |i, j| row_weights[i] * q[(i, j)]);
        Ok(Self { pivots, weighted_q, r: qr.thin_R().to_owned(), l11 })
    }

    pub(super) fn rank(&self) -> usize {
        self.pivots.len()
    }

    pub(super) fn n_bytes(&self) -> usize {
        (self.weighted_q.nrows() + 2 * self.rank()) * self.rank() * size_of::<f64>()
    }

    /// `Λ = P_Z L₁₁⁻ᵀ R⁻¹ Qᵀ S² Y`, column by column, in place.
    pub(super) fn solve_in_place(&self, mut values: MatMut<'_, f64>) {
        let par = super::parallelism(f64::INFINITY);
        let mut c = self.weighted_q.transpose() * values.as_ref();
        solve_upper_triangular_in_place(self.r.as_ref(), c.as_mut(), par);
        solve_upper_triangular_in_place(self.l11.transpose(), c.as_mut(), par);
        values.fill(0.0);
        for (row, &pivot) in self.pivots.iter().enumerate() {
            for column in 0..c.ncols() {
                values[(pivot, column)] = c[(row, column)];
            }
        }
    }

    /// The transpose of [`Self::solve_in_place`].
    pub(super) fn solve_transposed_in_place(&self, mut functionals: MatMut<'_, f64>) {
        let par = super::parallelism(f64::INFINITY);
        let mut c = Mat::from_fn(self.rank(), functionals.ncols(), |i, j| functionals[(self.pivots[i], j)]);
        solve_lower_triangular_in_place(self.l11.as_ref(), c.as_mut(), par);
        solve_lower_triangular_in_place(self.r.transpose(), c.as_mut(), par);
        functionals.copy_from(&self.weighted_q * c);
    }
}

/// Row weights S (with one factor of S kept for the right-hand side) and ridge ρ, ρ² the largest α.
///
/// Points without noise among noisy ones get the weight of the pivot tolerance: what is below it is rounding of K itself.
fn least_squares_weights(regularization: &Regularization, kernel: &Kernel, n: usize) -> (Vec<f64>, f64) {
    match regularization {
        Regularization::Uniform(alpha) => (vec![1.0; n], alpha.sqrt()),
        Regularization::PerPoint(variances) => {
            let largest = variances.iter().fold(0.0, |a: f64, &b| a.max(b));
            let floor = PIVOT_TOLERANCE * kernel.at_zero();
            let weight = |&v: &f64| (largest.max(floor) / v.max(floor)).sqrt();
            (variances.iter().map(weight).collect(), largest.sqrt())
        }
    }
}

/// Pivoted Cholesky of K, column by column, until the largest remaining diagonal entry is rounding.
///
/// The columns of K are evaluated as they are needed: O(n r²) flops, O(n r) memory (Harbrecht, Peters and Schneider 2012).
fn pivoted_columns(
    cloud: &Cloud,
    kernel: &Kernel,
    observer: &dyn Observer,
) -> Result<(Vec<usize>, Vec<f64>), NumericsError> {
    let (nodes, n) = (Nodes::of(cloud), cloud.n_points());
    let tolerance = PIVOT_TOLERANCE * kernel.at_zero();
    let mut remaining = vec![kernel.at_zero(); n];
    let (mut pivots, mut columns) = (Vec::new(), Vec::<f64>::new());
    let mut column = vec![0.0; n];
    while pivots.len() < n {
        let largest = remaining.iter().copied().fold(0.0, f64::max);
        let Some(pivot) = remaining.iter().position(|&d| d == largest && d > tolerance) else { break };
        let at_pivot = Cloud::new(cloud.point(pivot).to_vec(), cloud.dimension())?;
        fill_cross_gram(&nodes, kernel, &at_pivot, &mut column, observer)?;
        column.par_chunks_mut(ROWS_PER_TASK).enumerate().for_each(|(task, rows)| {
            for previous in columns.chunks_exact(n) {
                let factor = previous[pivot];
                for (entry, &l) in rows.iter_mut().zip(&previous[task * ROWS_PER_TASK..]) {
                    *entry -= factor * l;
                }
            }
        });
        let scale = 1.0 / largest.sqrt();
        for (point, entry) in column.iter_mut().enumerate() {
            *entry *= scale;
            remaining[point] -= *entry * *entry;
        }
        // Exact by construction; rounding must not make it a candidate again.
        remaining[pivot] = 0.0;
        for &earlier in &pivots {
            column[earlier] = 0.0;
        }
        column[pivot] = largest.sqrt();
        columns.extend_from_slice(&column);
        pivots.push(pivot);
    }
    Ok((pivots, columns))
}
