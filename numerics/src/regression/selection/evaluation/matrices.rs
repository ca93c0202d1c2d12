//! Matrices of an evaluation, whose memory the next evaluation reuses.

use std::convert::Infallible;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::prelude::ReborrowMut;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

use crate::error::Result;
use crate::kernel::Kernel;
use crate::machine::parallelism::parallelism;
use crate::machine::vector::dot;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::regression::solver::{SMALLEST_PIVOT, estimate_norm1, factorize_in_place};
use crate::regression::sums::gram::{fill_kernel_column, fill_lower_gram};
use crate::regression::sums::nodes::Nodes;
use crate::regression::sums::regularization::Regularization;

/// Columns of a matrix product between two checks for cancellation.
const COLUMNS_PER_CHECKPOINT: usize = 512;

/// Splits n columns into blocks. Yields the first column and the width of each.
fn blocks(n: usize) -> impl Iterator<Item = (usize, usize)> {
    let firsts = (0..n).step_by(COLUMNS_PER_CHECKPOINT);
    firsts.map(move |first| (first, COLUMNS_PER_CHECKPOINT.min(n - first)))
}

/// Returns `‖A‖₁` of a symmetric matrix, from its lower triangle.
fn norm1_of_lower(matrix: &[f64], n: usize) -> f64 {
    let mut sums = vec![0.0; n];
    for (j, column) in matrix.chunks_exact(n).enumerate() {
        let (of_diagonal, below) = sums[j..].split_at_mut(1);
        of_diagonal[0] += column[j..].iter().map(|entry| entry.abs()).sum::<f64>();
        below.iter_mut().zip(&column[j + 1..]).for_each(|(sum, entry)| *sum += entry.abs());
    }
    sums.into_iter().fold(0.0, f64::max)
}

/// The factor L of `K + N = LLᵀ`, and two matrices computed from it. All are lower triangles, stored column
/// by column.
pub(in crate::regression::selection) struct Matrices {
    n: usize,
    /// True for one of many tasks that run side by side. Its work stays on one thread, since a thread that
    /// waits for parts would begin other tasks, with memory of their own.
    pub(in crate::regression::selection) is_alone: bool,
    par: Par,
    factor: Vec<f64>,
    /// `‖K + N‖₁`.
    norm1: f64,
    /// L⁻¹, later overwritten by `P diag(c)^½`, whose product with its transpose is formed.
    inverse_factor: Vec<f64>,
    has_inverse_factor: bool,
    product: Vec<f64>,
    /// Scratch memory for a factorization on one thread.
    scratch: Option<MemBuffer>,
}

impl Matrices {
    /// Creates the matrices of n points, which work on the calling thread alone, if `is_alone`, or on all
    /// threads. Their memory is allocated when it is needed.
    pub(in crate::regression::selection) fn new(n: usize, is_alone: bool) -> Self {
        let par = if is_alone { Par::Seq } else { parallelism((n as f64).powi(3) / 3.0) };
        let scratch = || llt::factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, Default::default());
        Self {
            n,
            is_alone,
            par,
            factor: Vec::new(),
            norm1: 0.0,
            inverse_factor: Vec::new(),
            has_inverse_factor: false,
            product: Vec::new(),
            scratch: is_alone.then(|| MemBuffer::new(scratch())),
        }
    }

    /// Factorizes `K + N = LLᵀ`. Returns whether that succeeds in float64.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(in crate::regression::selection) fn factorize(
        &mut self,
        cloud: &Cloud,
        kernel: &Kernel,
        noise: &Regularization,
        observer: &dyn Observer,
    ) -> Result<bool> {
        let n = self.n;
        self.has_inverse_factor = false;
        self.factor.resize(n * n, 0.0);
        if self.is_alone {
            let nodes = Nodes::of(cloud);
            for (j, column) in self.factor.chunks_exact_mut(n).enumerate() {
                fill_kernel_column(&nodes, kernel, cloud.point(j), j..n, &mut column[j..]);
                column[j] += noise.at(j);
            }
        } else {
            fill_lower_gram(cloud, kernel, noise, &mut self.factor, n, observer)?;
        }
        self.norm1 = norm1_of_lower(&self.factor, n);
        let mut factor = MatMut::from_column_major_slice_mut(&mut self.factor, n, n);
        let least = SMALLEST_PIVOT * kernel.at_zero();
        let Some(scratch) = &mut self.scratch else {
            return Ok(factorize_in_place(factor, least, observer)?.is_ok());
        };
        let (stack, params) = (MemStack::new(scratch), Default::default());
        let made =
            llt::factor::cholesky_in_place(factor.rb_mut(), Default::default(), self.par, stack, params);
        Ok(made.is_ok() && (0..n).all(|i| factor[(i, i)] * factor[(i, i)] > least))
    }

    fn factor(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.factor, self.n, self.n)
    }

    /// `‖K + N‖₁`.
    pub(in crate::regression::selection) fn norm1(&self) -> f64 {
        self.norm1
    }

    /// Estimates `1/(‖K + N‖₁ ‖(K + N)⁻¹‖₁)`.
    pub(in crate::regression::selection) fn reciprocal_condition(&self) -> f64 {
        let solve = |mut columns: MatMut<'_, f64>| {
            solve_lower_triangular_in_place(self.factor(), columns.rb_mut(), self.par);
            solve_upper_triangular_in_place(self.factor().transpose(), columns, self.par);
            Ok::<(), Infallible>(())
        };
        let Ok((of_inverse, _)) = estimate_norm1(self.n, solve, solve);
        let product = self.norm1 * of_inverse;
        if product.is_finite() { 1.0 / product } else { 0.0 }
    }

    /// `ln det LLᵀ`.
    pub(in crate::regression::selection) fn log_determinant(&self) -> f64 {
        let factor = self.factor();
        (0..self.n).map(|i| factor[(i, i)].ln()).sum::<f64>() * 2.0
    }

    /// `columns ← L⁻¹ columns`.
    pub(in crate::regression::selection) fn whiten(&self, columns: &mut [f64]) {
        let m = columns.len() / self.n;
        let right = MatMut::from_column_major_slice_mut(columns, self.n, m);
        solve_lower_triangular_in_place(self.factor(), right, self.par);
    }

    /// `columns ← L⁻ᵀ columns`.
    pub(in crate::regression::selection) fn solve_whitened(&self, columns: &mut [f64]) {
        let m = columns.len() / self.n;
        let right = MatMut::from_column_major_slice_mut(columns, self.n, m);
        solve_upper_triangular_in_place(self.factor().transpose(), right, self.par);
    }

    /// Computes L⁻¹ unless it is there already.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(in crate::regression::selection) fn invert_factor(&mut self, observer: &dyn Observer) -> Result<()> {
        if self.has_inverse_factor {
            return Ok(());
        }
        let n = self.n;
        self.inverse_factor.resize(n * n, 0.0);
        let factor = MatRef::from_column_major_slice(&self.factor, n, n);
        let mut inverse = MatMut::from_column_major_slice_mut(&mut self.inverse_factor, n, n);
        for (first, width) in blocks(n) {
            observer.checkpoint()?;
            let rest = n - first;
            let mut columns = inverse.rb_mut().submatrix_mut(first, first, rest, width);
            columns.fill(0.0);
            (0..width).for_each(|k| columns[(k, k)] = 1.0);
            solve_lower_triangular_in_place(factor.submatrix(first, first, rest, rest), columns, self.par);
        }
        self.has_inverse_factor = true;
        Ok(())
    }

    /// Returns `W_ii = |L⁻¹e_i|²`, from L⁻¹.
    pub(in crate::regression::selection) fn inverse_diagonal(&self) -> Vec<f64> {
        let entry = |(i, column): (usize, &[f64])| dot(&column[i..], &column[i..]);
        if self.is_alone {
            self.inverse_factor.chunks_exact(self.n).enumerate().map(entry).collect()
        } else {
            self.inverse_factor.par_chunks_exact(self.n).enumerate().map(entry).collect()
        }
    }

    /// Computes `W = L⁻ᵀL⁻¹`, from L⁻¹.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(in crate::regression::selection) fn multiply_inverse(
        &mut self,
        observer: &dyn Observer,
    ) -> Result<()> {
        let n = self.n;
        self.product.resize(n * n, 0.0);
        let inverse = MatRef::from_column_major_slice(&self.inverse_factor, n, n);
        let mut product = MatMut::from_column_major_slice_mut(&mut self.product, n, n);
        for (first, width) in blocks(n) {
            observer.checkpoint()?;
            let rest = n - first;
            triangular::matmul(
                product.rb_mut().submatrix_mut(first, first, rest, width),
                BlockStructure::Rectangular,
                Accum::Replace,
                inverse.submatrix(first, first, rest, rest).transpose(),
                BlockStructure::TriangularUpper,
                inverse.submatrix(first, first, rest, width),
                BlockStructure::Rectangular,
                1.0,
                self.par,
            );
        }
        Ok(())
    }

    /// Computes `P diag(c) P` from W, with `P = W − TTᵀ` and c ≥ 0. Overwrites W and L⁻¹.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(in crate::regression::selection) fn multiply_columns(
        &mut self,
        of_mean: &[f64],
        c: &[f64],
        observer: &dyn Observer,
    ) -> Result<()> {
        let (n, product) = (self.n, &self.product);
        let fill = |(j, column): (usize, &mut [f64])| {
            let root = c[j].sqrt();
            for (i, entry) in column.iter_mut().enumerate() {
                let of_inverse = product[i.min(j) * n + i.max(j)];
                let of_mean: f64 = of_mean.chunks_exact(n).map(|t| t[i] * t[j]).sum();
                *entry = root * (of_inverse - of_mean);
            }
        };
        self.has_inverse_factor = false;
        if self.is_alone {
            self.inverse_factor.chunks_exact_mut(n).enumerate().for_each(fill)
        } else {
            self.inverse_factor.par_chunks_exact_mut(n).enumerate().for_each(fill)
        }
        let scaled = MatRef::from_column_major_slice(&self.inverse_factor, n, n);
        let mut product = MatMut::from_column_major_slice_mut(&mut self.product, n, n);
        for (first, width) in blocks(n) {
            observer.checkpoint()?;
            let rest = n - first;
            let columns = product.rb_mut().submatrix_mut(first, first, rest, width);
            let (rows, right) = (scaled.subrows(first, rest), scaled.subrows(first, width));
            matmul(columns, Accum::Replace, rows, right.transpose(), 1.0, self.par);
        }
        Ok(())
    }

    /// Returns the last product, `[n, n]`. Only its lower triangle counts.
    pub(in crate::regression::selection) fn product(&self) -> &[f64] {
        &self.product
    }
}
