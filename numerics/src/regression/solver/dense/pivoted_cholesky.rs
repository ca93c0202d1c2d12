//! Fallback where `K + D` is not positive definite in float64: least squares on the pivots of a
//! rank-revealing Cholesky factorization.
//!
//! WHY NOT QR of L: it needs Q or its reflections besides L₁₁. That is twice the memory of the Cholesky
//! factor where the rank is nearly n. In the values g that u takes at the pivots, the same problem is well
//! conditioned. Its matrix is the identity above `M = L₂₁L₁₁⁻¹`. Pivoting bounds the entries of M, so normal
//! equations lose nothing. M is solved for row by row, which leaves `ML₁₁ = L₂₁` to rounding. This is an
//! error in L, the same that QR makes.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, Mat, MatMut, MatRef};

use super::cholesky::factorize_in_place;
use super::pivoting::{Pivoting, Pivots};
use crate::error::{NumericsError, Result};
use crate::kernel::Kernel;
use crate::machine::heap::vec_bytes;
use crate::machine::parallelism::parallelism;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::regression::sums::regularization::Regularization;

/// Rows or columns between two checks for cancellation.
const ROWS_PER_CHECKPOINT: usize = 512;

/// Pivoted factorization `P(K + D)Pᵀ ≈ LLᵀ` with r columns, and the map from values to weights on the r
/// pivots Z.
///
/// The solution is `u = Σ_j b_j k(·, z_j)` with `min |(K + D)(X, Z) b − Y|²`. In the values g = L₁₁L₁₁ᵀb this
/// is `min |g − Y_Z|² + |Mg − Y₂|²`, with Y₂ the values at the other points. Hence `g = Y_Z + C(Y₂ − MY_Z)`,
/// a correction of what the pivots alone say. `C = (I + MᵀM)⁻¹Mᵀ = Mᵀ(I + MMᵀ)⁻¹`, and the smaller of the two
/// matrices is used.
pub(in crate::regression::solver) struct PivotedCholesky {
    /// Point of each row, pivots first.
    order: Vec<usize>,
    rank: usize,
    /// L₁₁ above M, `[n, r]`, column by column. After it the Cholesky factor of `I + MᵀM` or `I + MMᵀ`.
    buffer: Vec<f64>,
}

impl PivotedCholesky {
    /// Returns how many numbers any rank needs. `None` if the count overflows. Each thread needs O(n) more.
    pub(in crate::regression::solver) fn n_numbers_needed(n: usize) -> Option<usize> {
        n.checked_mul(n)
    }

    /// Factorizes within half of [`Self::n_numbers_needed`], or within all of it. `may_take_all` is asked
    /// before more than half is taken.
    ///
    /// # Errors
    /// [`NumericsError::WeightsOverflow`] beyond the range of float64. [`NumericsError::OutOfMemory`] if it
    /// needs all and may not take it. [`NumericsError::Cancelled`].
    pub(in crate::regression::solver) fn factorize(
        cloud: &Cloud,
        kernel: &Kernel,
        regularization: &Regularization,
        may_take_all: impl FnOnce() -> bool,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let n = cloud.n_points();
        let attempt = |max_rank: usize| {
            let mut buffer = vec![0.0; n_numbers(n, max_rank)];
            let pivots = Pivoting::new(cloud, kernel, regularization, &mut buffer).run(max_rank, observer)?;
            Ok::<_, NumericsError>((buffer, pivots))
        };
        // Smooth kernels have small ranks, and their buffer is small enough to be cut to size by copying. A
        // rough kernel begins again, after 5 n³/96 of its n³/3 flops.
        let (mut buffer, mut pivots) = attempt(n / 4)?;
        if pivots.is_complete {
            buffer.truncate(n_numbers(n, pivots.rank));
            buffer.shrink_to_fit();
        } else {
            drop(buffer);
            if !may_take_all() {
                return Err(NumericsError::OutOfMemory { n_bytes: n_numbers(n, n) * size_of::<f64>() });
            }
            (buffer, pivots) = attempt(n)?;
        }
        let Pivots { order, rank, .. } = pivots;
        let mut this = Self { order, rank, buffer };
        this.prepare_least_squares(observer)?;
        Ok(this)
    }

    /// Turns L₂₁ into M and factorizes `I + MᵀM` or `I + MMᵀ`.
    fn prepare_least_squares(&mut self, observer: &dyn Observer) -> Result<()> {
        let (n, rank) = (self.order.len(), self.rank);
        let (columns, rest) = self.buffer.split_at_mut(n * rank);
        let (l11, mut m) = MatMut::from_column_major_slice_mut(columns, n, rank).split_at_row_mut(rank);
        for first in (0..n - rank).step_by(ROWS_PER_CHECKPOINT) {
            observer.checkpoint()?;
            let rows = m.as_mut().subrows_mut(first, ROWS_PER_CHECKPOINT.min(n - rank - first));
            let par = parallelism((rank * rank * rows.nrows()) as f64);
            solve_upper_triangular_in_place(l11.as_ref().transpose(), rows.transpose_mut(), par);
        }
        let size = inner_size(n, rank);
        let m = m.as_ref();
        let factor = if size == rank { m.transpose() } else { m };
        let mut inner = MatMut::from_column_major_slice_mut(&mut rest[..size * size], size, size);
        for first in (0..size).step_by(ROWS_PER_CHECKPOINT) {
            observer.checkpoint()?;
            let width = ROWS_PER_CHECKPOINT.min(size - first);
            let lower = inner.as_mut().submatrix_mut(first, first, size - first, width);
            let (rows, columns) = (factor.subrows(first, size - first), factor.subrows(first, width));
            let par = parallelism((2 * (size - first) * width * factor.ncols()) as f64);
            matmul(lower, Accum::Replace, rows, columns.transpose(), 1.0, par);
        }
        for k in 0..size {
            inner[(k, k)] += 1.0;
        }
        factorize_in_place(inner, 0.0, observer)?.map_err(|_| NumericsError::WeightsOverflow)
    }

    /// Returns the points that have weights, `[r]`.
    pub(in crate::regression::solver) fn pivots(&self) -> &[usize] {
        &self.order[..self.rank]
    }

    pub(in crate::regression::solver) fn n_bytes(&self) -> usize {
        vec_bytes(&self.buffer) + vec_bytes(&self.order)
    }

    /// Overwrites values with weights, column by column: `Λ_Z = (L₁₁L₁₁ᵀ)⁻¹ (Y_Z + C(Y₂ − MY_Z))`, zero
    /// elsewhere.
    pub(in crate::regression::solver) fn solve_in_place(&self, mut values: MatMut<'_, f64>) {
        let (mut at_pivots, mut elsewhere) = self.split_rows(values.as_ref());
        let par = self.parallelism(values.ncols());
        matmul(elsewhere.as_mut(), Accum::Add, self.m(), at_pivots.as_ref(), -1.0, par);
        let correction = self.apply_c(elsewhere);
        at_pivots += correction;
        self.solve_at_pivots(at_pivots.as_mut());
        elsewhere = Mat::zeros(self.order.len() - self.rank, values.ncols());
        self.join_rows(&at_pivots, &elsewhere, values.as_mut());
    }

    /// Applies the transpose of [`Self::solve_in_place`]. With `p = (L₁₁L₁₁ᵀ)⁻¹ f_Z` and `t = Cᵀp`, the
    /// result is `p − Mᵀt` at the pivots and t elsewhere.
    pub(in crate::regression::solver) fn solve_transposed_in_place(&self, mut functionals: MatMut<'_, f64>) {
        let (mut at_pivots, _) = self.split_rows(functionals.as_ref());
        let par = self.parallelism(functionals.ncols());
        self.solve_at_pivots(at_pivots.as_mut());
        let elsewhere = self.apply_c_transposed(&at_pivots);
        matmul(at_pivots.as_mut(), Accum::Add, self.m().transpose(), elsewhere.as_ref(), -1.0, par);
        self.join_rows(&at_pivots, &elsewhere, functionals.as_mut());
    }

    /// Returns `C x`, either as `(I + MᵀM)⁻¹Mᵀ x` or as `Mᵀ(I + MMᵀ)⁻¹ x`.
    fn apply_c(&self, mut x: Mat<f64>) -> Mat<f64> {
        let (par, mut product) = (self.parallelism(x.ncols()), Mat::zeros(self.rank, x.ncols()));
        let is_outer = inner_size(self.order.len(), self.rank) != self.rank;
        if is_outer {
            self.solve_inner(x.as_mut());
        }
        matmul(product.as_mut(), Accum::Replace, self.m().transpose(), x.as_ref(), 1.0, par);
        if !is_outer {
            self.solve_inner(product.as_mut());
        }
        product
    }

    /// Returns `Cᵀ x`.
    fn apply_c_transposed(&self, x: &Mat<f64>) -> Mat<f64> {
        let (n, par) = (self.order.len(), self.parallelism(x.ncols()));
        let mut product = Mat::zeros(n - self.rank, x.ncols());
        if inner_size(n, self.rank) == self.rank {
            let mut x = x.clone();
            self.solve_inner(x.as_mut());
            matmul(product.as_mut(), Accum::Replace, self.m(), x.as_ref(), 1.0, par);
        } else {
            matmul(product.as_mut(), Accum::Replace, self.m(), x.as_ref(), 1.0, par);
            self.solve_inner(product.as_mut());
        }
        product
    }

    fn solve_at_pivots(&self, mut x: MatMut<'_, f64>) {
        let (l11, par) = (self.columns().subrows(0, self.rank), self.parallelism(x.ncols()));
        solve_lower_triangular_in_place(l11, x.as_mut(), par);
        solve_upper_triangular_in_place(l11.transpose(), x, par);
    }

    fn solve_inner(&self, mut x: MatMut<'_, f64>) {
        let (n, par) = (self.order.len(), self.parallelism(x.ncols()));
        let size = inner_size(n, self.rank);
        let factor = &self.buffer[n * self.rank..][..size * size];
        let factor = MatRef::from_column_major_slice(factor, size, size);
        solve_lower_triangular_in_place(factor, x.as_mut(), par);
        solve_upper_triangular_in_place(factor.transpose(), x, par);
    }

    fn columns(&self) -> MatRef<'_, f64> {
        let n = self.order.len();
        MatRef::from_column_major_slice(&self.buffer[..n * self.rank], n, self.rank)
    }

    fn m(&self) -> MatRef<'_, f64> {
        self.columns().subrows(self.rank, self.order.len() - self.rank)
    }

    fn parallelism(&self, n_columns: usize) -> faer::Par {
        parallelism((2 * self.order.len() * self.rank * n_columns) as f64)
    }

    /// Returns the rows of the pivots and the other rows, in the order of the factor.
    fn split_rows(&self, x: MatRef<'_, f64>) -> (Mat<f64>, Mat<f64>) {
        let (pivots, others) = self.order.split_at(self.rank);
        let rows = |order: &[usize]| Mat::from_fn(order.len(), x.ncols(), |i, j| x[(order[i], j)]);
        (rows(pivots), rows(others))
    }

    fn join_rows(&self, at_pivots: &Mat<f64>, elsewhere: &Mat<f64>, mut x: MatMut<'_, f64>) {
        for j in 0..x.ncols() {
            for (row, &point) in self.order.iter().enumerate() {
                let found =
                    row.checked_sub(self.rank).map_or_else(|| at_pivots[(row, j)], |i| elsewhere[(i, j)]);
                x[(point, j)] = found;
            }
        }
    }
}

/// Returns the order of the smaller of `I + MᵀM` and `I + MMᵀ`.
fn inner_size(n: usize, rank: usize) -> usize {
    rank.min(n - rank)
}

/// Returns how many numbers a factorization of this rank has: at most n².
fn n_numbers(n: usize, rank: usize) -> usize {
    n * rank + inner_size(n, rank) * inner_size(n, rank)
}
