//! Pivoted Cholesky factorization, in blocks of pivots; columns of K are evaluated as they are needed.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, MatMut, MatRef};
use rayon::prelude::*;

use super::parallelism;
use crate::numerics::cloud::Cloud;
use crate::numerics::error::NumericsError;
use crate::numerics::gram::fill_cross_gram;
use crate::numerics::kernel::Kernel;
use crate::numerics::nodes::Nodes;
use crate::numerics::observer::Observer;
use crate::numerics::regularization::Regularization;

/// Pivots below this multiple of k₀ are rounding (numerics.md, Fit 2).
const PIVOT_TOLERANCE: f64 = 64.0 * f64::EPSILON;

/// Candidates looked at together: wide enough for matrix products at full speed (rough kernels accept nearly all of them).
const CANDIDATES: usize = 128;

/// A pivot is accepted while it is at least this fraction of the largest remaining diagonal entry when its block began.
///
/// It bounds the entries of `L₂₁L₁₁⁻¹` as strict pivoting does, up to a factor √10 for each pivot instead of 1.
const WORTH: f64 = 0.1;

/// `P(K + D)Pᵀ ≈ LLᵀ` with r columns in the making, D the regularization.
///
/// A pivot is a point with a large diagonal entry of `K + D − LLᵀ`, as in LAPACK's `dpstrf` (Hammarling, Higham and Lucas
/// 2007), but whole blocks of candidates are taken, the weak ones put back (as Epperly, Tropp and Webber 2024 do for random
/// pivots), and columns of K are evaluated only for pivots (Harbrecht, Peters and Schneider 2012): n r kernel values,
/// `n r² − ⅔r³` flops in matrix products, no memory beside the n r numbers of L but O(n) per thread.
pub(super) struct Pivoting<'a> {
    cloud: &'a Cloud,
    kernel: &'a Kernel,
    regularization: &'a Regularization,
    nodes: Nodes,
    /// The point of each row: pivots first, in the order of their choice.
    order: Vec<usize>,
    /// Diagonal of `K + D − LLᵀ`, row by row.
    remaining: Vec<f64>,
    /// L column by column, n numbers each; what stands above its diagonal is zero.
    columns: &'a mut [f64],
    rank: usize,
}

/// The outcome: the columns of L are in the buffer.
pub(super) struct Pivots {
    /// The point of each row, pivots first.
    pub(super) order: Vec<usize>,
    /// Number of pivots.
    pub(super) rank: usize,
    /// Whether what remains is rounding; if not, the pivots did not fit.
    pub(super) is_complete: bool,
}

impl<'a> Pivoting<'a> {
    pub(super) fn new(
        cloud: &'a Cloud,
        kernel: &'a Kernel,
        regularization: &'a Regularization,
        columns: &'a mut [f64],
    ) -> Self {
        let n = cloud.n_points();
        let remaining = (0..n).map(|point| kernel.at_zero() + regularization.at(point)).collect();
        let order = (0..n).collect();
        Self { cloud, kernel, regularization, nodes: Nodes::of(cloud), order, remaining, columns, rank: 0 }
    }

    /// Adds pivots until the largest remaining diagonal entry is rounding, or more than `max_rank` would be needed.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(super) fn run(mut self, max_rank: usize, observer: &dyn Observer) -> Result<Pivots, NumericsError> {
        let is_complete = loop {
            observer.checkpoint()?;
            let largest = self.remaining[self.rank..].iter().copied().fold(0.0, f64::max);
            let tolerance = PIVOT_TOLERANCE * self.kernel.at_zero();
            if largest <= tolerance {
                break true;
            }
            let floor = tolerance.max(WORTH * largest);
            let n_candidates = self.gather_candidates(floor);
            let mut block = self.schur_complement(n_candidates, observer)?;
            for k in 0..n_candidates {
                // The same number with the rounding of one sum instead of many: no candidate comes back for ever.
                self.remaining[self.rank + k] = block[k * (n_candidates + 1)];
            }
            let (swaps, n_accepted) = pivot_block(&mut block, n_candidates, floor);
            if self.rank + n_accepted > max_rank {
                break false;
            }
            self.swap_rows(&swaps);
            self.append(&block, n_candidates, n_accepted, observer)?;
        };
        Ok(Pivots { order: self.order, rank: self.rank, is_complete })
    }

    /// Moves the rows with the largest remaining entries above `floor` behind the pivots; returns how many.
    fn gather_candidates(&mut self, floor: f64) -> usize {
        let remaining = &self.remaining;
        let mut rows: Vec<usize> =
            (self.rank..remaining.len()).filter(|&row| remaining[row] > floor).collect();
        if rows.len() > CANDIDATES {
            let descending = |a: &usize, b: &usize| remaining[*b].total_cmp(&remaining[*a]).then(a.cmp(b));
            rows.select_nth_unstable_by(CANDIDATES, descending);
            rows.truncate(CANDIDATES);
        }
        // Ascending, so that no swap moves a row that a later one names.
        rows.sort_unstable();
        let swaps: Vec<(usize, usize)> = rows.iter().copied().enumerate().collect();
        self.swap_rows(&swaps.iter().map(|&(k, row)| (k, row - self.rank)).collect::<Vec<_>>());
        rows.len()
    }

    /// Swaps pairs of rows, counted from the first row that is no pivot.
    fn swap_rows(&mut self, swaps: &[(usize, usize)]) {
        let first = self.rank;
        for &(a, b) in swaps {
            self.order.swap(first + a, first + b);
            self.remaining.swap(first + a, first + b);
        }
        let n = self.order.len();
        self.columns[..first * n].par_chunks_mut(n).for_each(|column| {
            for &(a, b) in swaps {
                column.swap(first + a, first + b);
            }
        });
    }

    /// `K + D − LLᵀ` at the first rows that are no pivots, column by column, both triangles.
    fn schur_complement(&self, n_rows: usize, observer: &dyn Observer) -> Result<Vec<f64>, NumericsError> {
        let (n, first) = (self.order.len(), self.rank);
        let candidates = self.points(first, n_rows)?;
        let mut block = vec![0.0; n_rows * n_rows];
        fill_cross_gram(&Nodes::of(&candidates), self.kernel, &candidates, &mut block, observer)?;
        for k in 0..n_rows {
            block[k * (n_rows + 1)] += self.regularization.at(self.order[first + k]);
        }
        let l = MatRef::from_column_major_slice(&self.columns[..n * first], n, first).subrows(first, n_rows);
        let par = parallelism((2 * n_rows * n_rows * first) as f64);
        let schur = MatMut::from_column_major_slice_mut(&mut block, n_rows, n_rows);
        matmul(schur, Accum::Add, l, l.transpose(), -1.0, par);
        Ok(block)
    }

    /// Appends the columns of accepted pivots, whose factor is the leading part of `block`.
    fn append(
        &mut self,
        block: &[f64],
        n_candidates: usize,
        n_accepted: usize,
        observer: &dyn Observer,
    ) -> Result<(), NumericsError> {
        if n_accepted == 0 {
            return Ok(());
        }
        let (n, first) = (self.order.len(), self.rank);
        let below = first + n_accepted;
        let pivots = self.points(first, n_accepted)?;
        let (before, rest) = self.columns.split_at_mut(n * first);
        let new = &mut rest[..n * n_accepted];
        fill_cross_gram(&self.nodes, self.kernel, &pivots, new, observer)?;
        new.par_chunks_mut(n).enumerate().for_each(|(k, column)| {
            let by_point = column.to_vec();
            column[..first + k].fill(0.0);
            column[first + k..below].copy_from_slice(&block[k * n_candidates + k..][..n_accepted - k]);
            for (entry, &point) in column[below..].iter_mut().zip(&self.order[below..]) {
                *entry = by_point[point];
            }
        });
        let par = parallelism((2 * (n - first) * n_accepted * (first + n_accepted)) as f64);
        let l = MatRef::from_column_major_slice(before, n, first);
        let (upper, mut lower) =
            MatMut::from_column_major_slice_mut(&mut *new, n, n_accepted).split_at_row_mut(below);
        matmul(
            lower.as_mut(),
            Accum::Add,
            l.subrows(below, n - below),
            l.subrows(first, n_accepted).transpose(),
            -1.0,
            par,
        );
        let l11 = upper.as_ref().subrows(first, n_accepted);
        solve_lower_triangular_in_place(l11, lower.transpose_mut(), par);
        for column in new.chunks_exact(n) {
            for (remaining, l) in self.remaining[below..].iter_mut().zip(&column[below..]) {
                *remaining -= l * l;
            }
        }
        self.rank = below;
        Ok(())
    }

    /// The points of some rows.
    fn points(&self, first: usize, n_rows: usize) -> Result<Cloud, NumericsError> {
        let rows = self.order[first..][..n_rows].iter();
        let coordinates = rows.flat_map(|&point| self.cloud.point(point)).copied().collect();
        Cloud::new(coordinates, self.cloud.dimension())
    }
}

/// Pivoted Cholesky of a small symmetric matrix, in place, while pivots are above `floor`: the swaps of rows in order, and how
/// many columns of the factor there are.
fn pivot_block(a: &mut [f64], n: usize, floor: f64) -> (Vec<(usize, usize)>, usize) {
    let mut swaps = Vec::new();
    for k in 0..n {
        let diagonal = |i: usize| a[i * (n + 1)];
        let pivot = (k..n).fold(k, |best, i| if diagonal(i) > diagonal(best) { i } else { best });
        let largest = diagonal(pivot);
        if largest.is_nan() || largest <= floor {
            break;
        }
        swaps.push((k, pivot));
        for c in 0..n {
            a.swap(c * n + k, c * n + pivot);
        }
        for i in 0..n {
            a.swap(k * n + i, pivot * n + i);
        }
        let root = largest.sqrt();
        let (before, after) = a.split_at_mut((k + 1) * n);
        let column = &mut before[k * n..];
        column[k..].iter_mut().for_each(|x| *x /= root);
        column[k] = root;
        for (j, other) in after.chunks_exact_mut(n).enumerate() {
            let factor = column[k + 1 + j];
            for (x, l) in other[k + 1..].iter_mut().zip(&column[k + 1..]) {
                *x -= factor * l;
            }
        }
    }
    let n_accepted = swaps.len();
    (swaps, n_accepted)
}
