//! Rows of `F = K(X, Z) L₁₁⁻ᵀ` or of `M = F L₁₁⁻¹`, a block of points at a time.

use std::ops::Range;
use std::sync::Arc;

use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Mat, MatMut, MatRef};
use rayon::prelude::*;

use crate::error::Result;
use crate::kernel::Kernel;
use crate::machine::heap::vec_bytes;
use crate::machine::parallelism::parallelism;
use crate::machine::vector::dot;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::regression::solver::system::System;
use crate::regression::sums::gram::fill_cross_gram;
use crate::regression::sums::nodes::Nodes;

/// Points of a block: wide enough for matrix products at full speed.
pub(super) const BLOCK: usize = 1024;

/// Unknowns of the normal equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Coordinates {
    /// `β = L₁₁ᵀb`, with rows of F.
    Whitened,
    /// `g = K_ZZ b`, with rows of M.
    AtLandmarks,
}

/// The landmarks Z with the factor of their kernel matrix, `K_ZZ = L₁₁L₁₁ᵀ`.
pub(super) struct Rows {
    /// Indices of the landmarks among the points.
    points: Vec<usize>,
    cloud: Arc<Cloud>,
    nodes: Nodes,
    l11: Mat<f64>,
    coordinates: Coordinates,
    kept: Option<StoredRows>,
}

/// The rows of all points, where they are few.
struct StoredRows {
    /// What remains of the diagonal, `[n]`.
    remaining: Vec<f64>,
    /// F or M, transposed, `[r, n]`.
    numbers: Vec<f64>,
}

/// Largest count of numbers of rows that are kept for the next pass.
pub(super) const MOST_KEPT: usize = 4_000_000;

/// The rows of some points, as columns.
pub(super) struct Block<'a> {
    /// What remains of the diagonal at each point, `k₀ − |L₁₁⁻¹k(Z, x)|²`.
    pub remaining: &'a [f64],
    /// F or M, transposed, `[r, points]`.
    pub rows: MatRef<'a, f64>,
}

impl Rows {
    pub(super) fn of(points: Vec<usize>, cloud: Cloud, l11: Mat<f64>, coordinates: Coordinates) -> Self {
        Self { points, nodes: Nodes::of(&cloud), cloud: Arc::new(cloud), l11, coordinates, kept: None }
    }

    pub(super) fn coordinates(&self) -> Coordinates {
        self.coordinates
    }

    pub(super) fn n_landmarks(&self) -> usize {
        self.points.len()
    }

    pub(super) fn points(&self) -> &[usize] {
        &self.points
    }

    pub(super) fn cloud(&self) -> &Arc<Cloud> {
        &self.cloud
    }

    /// L₁₁, with zeros above its diagonal.
    pub(super) fn l11(&self) -> &Mat<f64> {
        &self.l11
    }

    /// Turns unknowns into the weights b of the landmarks.
    pub(super) fn to_weights(&self, mut x: MatMut<'_, f64>) {
        if self.coordinates == Coordinates::AtLandmarks {
            self.whiten(x.as_mut());
        }
        self.solve_upper(x);
    }

    /// Turns covariances with the landmarks into a row of F or M.
    pub(super) fn to_row(&self, mut covariances: MatMut<'_, f64>) {
        self.whiten(covariances.as_mut());
        if self.coordinates == Coordinates::AtLandmarks {
            self.solve_upper(covariances);
        }
    }

    /// `x ← L₁₁⁻¹x`.
    pub(super) fn whiten(&self, x: MatMut<'_, f64>) {
        let par = parallelism((x.nrows() * x.nrows() * x.ncols()) as f64);
        solve_lower_triangular_in_place(self.l11.as_ref(), x, par);
    }

    /// `x ← L₁₁⁻ᵀx`.
    pub(super) fn solve_upper(&self, x: MatMut<'_, f64>) {
        let par = parallelism((x.nrows() * x.nrows() * x.ncols()) as f64);
        solve_upper_triangular_in_place(self.l11.transpose(), x, par);
    }

    /// Keeps the rows of all points for the passes to come, if they are few.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    pub(super) fn keep(&mut self, system: &System, observer: &dyn Observer) -> Result<()> {
        let n_numbers = self.n_landmarks() * system.n_points();
        if self.kept.is_some() || n_numbers > MOST_KEPT {
            return Ok(());
        }
        let mut numbers = vec![0.0; n_numbers];
        let remaining = self.fill(system.kernel(), system.cloud(), &mut numbers, observer)?;
        self.kept = Some(StoredRows { remaining, numbers });
        Ok(())
    }

    /// Keeps the rows that pivoting over all points has left, if they are few: those of `l` (`[n, r]`) are F,
    /// in the order of the pivots.
    pub(super) fn keep_factor(&mut self, kernel: &Kernel, l: MatRef<'_, f64>, order: &[usize]) {
        let (n, rank) = (order.len(), self.n_landmarks());
        if self.coordinates != Coordinates::Whitened || rank == 0 || n * rank > MOST_KEPT {
            return;
        }
        let mut numbers = vec![0.0; n * rank];
        for (row, &point) in order.iter().enumerate() {
            let of_point = &mut numbers[point * rank..][..rank];
            of_point.iter_mut().enumerate().for_each(|(k, number)| *number = l[(row, k)]);
        }
        let left = |row: &[f64]| kernel.at_zero() - dot(row, row);
        let remaining = numbers.chunks_exact(rank).map(left).collect();
        self.kept = Some(StoredRows { remaining, numbers });
    }

    /// Bytes of the rows that are kept.
    pub(super) fn n_bytes_kept(&self) -> usize {
        self.kept.as_ref().map_or(0, |kept| vec_bytes(&kept.remaining) + vec_bytes(&kept.numbers))
    }

    /// Goes over the points in order, a block at a time.
    ///
    /// # Errors
    /// [`crate::error::NumericsError::Cancelled`].
    pub(super) fn for_each_block(
        &self,
        system: &System,
        observer: &dyn Observer,
        mut take: impl FnMut(Range<usize>, Block<'_>),
    ) -> Result<()> {
        if let Some(StoredRows { remaining, numbers }) = &self.kept {
            let rows = MatRef::from_column_major_slice(numbers, self.n_landmarks(), remaining.len());
            observer.checkpoint()?;
            take(0..remaining.len(), Block { remaining, rows });
            return Ok(());
        }
        let (cloud, kernel) = (system.cloud(), system.kernel());
        let (n, d) = (cloud.n_points(), cloud.dimension());
        let mut buffer = vec![0.0; self.n_landmarks() * BLOCK.min(n)];
        for first in (0..n).step_by(BLOCK) {
            observer.checkpoint()?;
            let points = first..(first + BLOCK).min(n);
            let block = Cloud::new(cloud.coordinates()[first * d..points.end * d].to_vec(), d)?;
            let numbers = &mut buffer[..self.n_landmarks() * points.len()];
            let remaining = self.fill(kernel, &block, numbers, observer)?;
            let rows = MatRef::from_column_major_slice(numbers, self.n_landmarks(), points.len());
            take(points, Block { remaining: &remaining, rows });
        }
        Ok(())
    }

    /// Fills the rows, as columns, and returns what remains of the diagonal.
    fn fill(
        &self,
        kernel: &Kernel,
        block: &Cloud,
        numbers: &mut [f64],
        observer: &dyn Observer,
    ) -> Result<Vec<f64>> {
        let rank = self.n_landmarks();
        fill_cross_gram(&self.nodes, kernel, block, numbers, observer)?;
        let mut columns = MatMut::from_column_major_slice_mut(numbers, rank, block.n_points());
        self.whiten(columns.as_mut());
        let whitened = columns.as_ref();
        let left = |j: usize| kernel.at_zero() - whitened.col(j).squared_norm_l2();
        let remaining = (0..block.n_points()).into_par_iter().map(left).collect();
        if self.coordinates == Coordinates::AtLandmarks {
            self.solve_upper(columns);
        }
        Ok(remaining)
    }
}
