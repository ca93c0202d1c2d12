//! The matrices of an evaluation, in memory that is kept from one to the next.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::prelude::ReborrowMut;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

use crate::numerics::error::NumericsError;
use crate::numerics::kernel::Kernel;
use crate::numerics::machine::vector::dot;
use crate::numerics::observer::Observer;
use crate::numerics::points::cloud::Cloud;
use crate::numerics::solver::parallelism;
use crate::numerics::sums::gram::{fill_kernel_column, fill_lower_gram};
use crate::numerics::sums::nodes::Nodes;
use crate::numerics::sums::regularization::Regularization;

/// A pivot up to this multiple of k₀ is rounding, as in a factorization that is kept.
const SMALLEST_PIVOT: f64 = 16.0 * f64::EPSILON;

/// L with `K + N = LLᵀ`, and two matrices that are made from it; column by column, lower triangles.
pub(super) struct Matrices {
    n: usize,
    /// One of many tasks: threads that wait for parts of it would begin others, with memory of their own.
    pub(super) is_alone: bool,
    par: Par,
    factor: Vec<f64>,
    /// L⁻¹, and then what is multiplied by its own transpose.
    inverse_factor: Vec<f64>,
    has_inverse_factor: bool,
    product: Vec<f64>,
    scratch: MemBuffer,
}

impl Matrices {
    /// For n points: alone on this thread, or on all of them. Memory is taken when it is needed.
    pub(super) fn new(n: usize, is_alone: bool) -> Self {
        let par = if is_alone { Par::Seq } else { parallelism((n as f64).powi(3) / 3.0) };
        let requirement = llt::factor::cholesky_in_place_scratch::<f64>(n, par, Default::default());
        Self {
            n,
            is_alone,
            par,
            factor: Vec::new(),
            inverse_factor: Vec::new(),
            has_inverse_factor: false,
            product: Vec::new(),
            scratch: MemBuffer::new(requirement),
        }
    }

    /// Whether `K + N = LLᵀ` in float64.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(super) fn factorize(
        &mut self,
        (cloud, kernel): (&Cloud, &Kernel),
        noise: &Regularization,
        observer: &dyn Observer,
    ) -> Result<bool, NumericsError> {
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
        let mut factor = MatMut::from_column_major_slice_mut(&mut self.factor, n, n);
        let (stack, params) = (MemStack::new(&mut self.scratch), Default::default());
        let made =
            llt::factor::cholesky_in_place(factor.rb_mut(), Default::default(), self.par, stack, params);
        let least = SMALLEST_PIVOT * kernel.at_zero();
        Ok(made.is_ok() && (0..n).all(|i| factor[(i, i)] * factor[(i, i)] > least))
    }

    fn factor(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.factor, self.n, self.n)
    }

    /// `ln det LLᵀ`.
    pub(super) fn log_determinant(&self) -> f64 {
        let factor = self.factor();
        (0..self.n).map(|i| factor[(i, i)].ln()).sum::<f64>() * 2.0
    }

    /// `columns ← L⁻¹ columns`.
    pub(super) fn whiten(&self, columns: &mut [f64]) {
        let m = columns.len() / self.n;
        let right = MatMut::from_column_major_slice_mut(columns, self.n, m);
        solve_lower_triangular_in_place(self.factor(), right, self.par);
    }

    /// `columns ← L⁻ᵀ columns`.
    pub(super) fn solve_whitened(&self, columns: &mut [f64]) {
        let m = columns.len() / self.n;
        let right = MatMut::from_column_major_slice_mut(columns, self.n, m);
        solve_upper_triangular_in_place(self.factor().transpose(), right, self.par);
    }

    /// Makes L⁻¹, if it is not there.
    pub(super) fn invert_factor(&mut self) {
        if self.has_inverse_factor {
            return;
        }
        let n = self.n;
        self.inverse_factor.resize(n * n, 0.0);
        let inverse = MatMut::from_column_major_slice_mut(&mut self.inverse_factor, n, n);
        invert_lower_triangular(inverse, MatRef::from_column_major_slice(&self.factor, n, n), self.par);
        self.has_inverse_factor = true;
    }

    /// `W_ii = |L⁻¹e_i|²`, from L⁻¹.
    pub(super) fn inverse_diagonal(&self) -> Vec<f64> {
        let entry = |(i, column): (usize, &[f64])| dot(&column[i..], &column[i..]);
        match self.is_alone {
            true => self.inverse_factor.chunks_exact(self.n).enumerate().map(entry).collect(),
            false => self.inverse_factor.par_chunks_exact(self.n).enumerate().map(entry).collect(),
        }
    }

    /// `W = L⁻ᵀL⁻¹`, from L⁻¹.
    pub(super) fn multiply_inverse(&mut self) {
        let n = self.n;
        self.product.resize(n * n, 0.0);
        let inverse = MatRef::from_column_major_slice(&self.inverse_factor, n, n);
        triangular::matmul(
            MatMut::from_column_major_slice_mut(&mut self.product, n, n),
            BlockStructure::TriangularLower,
            Accum::Replace,
            inverse.transpose(),
            BlockStructure::TriangularUpper,
            inverse,
            BlockStructure::TriangularLower,
            1.0,
            self.par,
        );
    }

    /// `P diag(c) P` with `P = W − TTᵀ`, from W; c not negative. Takes the place of L⁻¹.
    pub(super) fn multiply_columns(&mut self, of_mean: &[f64], c: &[f64]) {
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
        match self.is_alone {
            true => self.inverse_factor.chunks_exact_mut(n).enumerate().for_each(fill),
            false => self.inverse_factor.par_chunks_exact_mut(n).enumerate().for_each(fill),
        }
        let scaled = MatRef::from_column_major_slice(&self.inverse_factor, n, n);
        triangular::matmul(
            MatMut::from_column_major_slice_mut(&mut self.product, n, n),
            BlockStructure::TriangularLower,
            Accum::Replace,
            scaled,
            BlockStructure::Rectangular,
            scaled.transpose(),
            BlockStructure::Rectangular,
            1.0,
            self.par,
        );
    }

    /// The last product, `[n, n]`, of which the lower triangle counts.
    pub(super) fn product(&self) -> &[f64] {
        &self.product
    }
}
