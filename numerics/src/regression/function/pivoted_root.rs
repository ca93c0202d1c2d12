//! Cholesky factorization with complete pivoting, for a matrix whose entries are all in memory.

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::prelude::ReborrowMut;
use faer::{Accum, MatMut};

use crate::error::Result;
use crate::machine::parallelism::parallelism;
use crate::observer::Observer;

/// Columns per block. After each block the rest is updated and cancellation is checked.
const COLUMNS_PER_BLOCK: usize = 64;

/// The order and the number of the pivots of `PAPᵀ ≈ LLᵀ`.
///
/// Within a block, columns are factorized one pivot after the other. The rest is updated once per block, as
/// in LAPACK's `dpstrf` (Hammarling, Higham and Lucas 2007). faer has this factorization too, but cannot be
/// cancelled.
pub(super) struct PivotedRoot {
    /// The row of A in each row of L, pivots first.
    pub(super) order: Vec<usize>,
    pub(super) rank: usize,
}

impl PivotedRoot {
    /// Overwrites the lower triangle of a symmetric matrix `[m, m]` by L.
    ///
    /// The factorization ends when every remaining diagonal entry is at most `tolerance`. Only the first
    /// `rank` columns of L are valid.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(super) fn of(matrix: &mut [f64], m: usize, tolerance: f64, observer: &dyn Observer) -> Result<Self> {
        let mut matrix = MatMut::from_column_major_slice_mut(matrix, m, m);
        let mut order: Vec<usize> = (0..m).collect();
        for first in (0..m).step_by(COLUMNS_PER_BLOCK) {
            observer.checkpoint()?;
            let end = m.min(first + COLUMNS_PER_BLOCK);
            let mut remaining: Vec<f64> = (0..m).map(|row| matrix[(row, row)]).collect();
            for column in first..end {
                let pivot = (column..m)
                    .fold(column, |best, row| if remaining[row] > remaining[best] { row } else { best });
                if remaining[pivot] <= tolerance {
                    return Ok(Self { order, rank: column });
                }
                swap(matrix.rb_mut(), column, pivot);
                order.swap(column, pivot);
                remaining.swap(column, pivot);
                make_column(matrix.rb_mut(), first, column, remaining[column].sqrt());
                for row in column + 1..m {
                    remaining[row] -= matrix[(row, column)] * matrix[(row, column)];
                }
            }
            update(matrix.rb_mut(), first, end);
        }
        Ok(Self { order, rank: m })
    }
}

/// Swaps rows and columns a ≤ b of a symmetric matrix, in its lower triangle.
fn swap(mut matrix: MatMut<'_, f64>, a: usize, b: usize) {
    let m = matrix.nrows();
    let mut exchange = |p: [usize; 2], q: [usize; 2]| {
        let kept = matrix[(p[0], p[1])];
        matrix[(p[0], p[1])] = matrix[(q[0], q[1])];
        matrix[(q[0], q[1])] = kept;
    };
    if a == b {
        return;
    }
    exchange([a, a], [b, b]);
    (0..a).for_each(|column| exchange([a, column], [b, column]));
    (a + 1..b).for_each(|k| exchange([k, a], [b, k]));
    (b + 1..m).for_each(|row| exchange([row, a], [row, b]));
}

/// Overwrites a column of the matrix by that of L, whose diagonal entry is `diagonal`.
///
/// The columns of L before `first` have already been subtracted from it, those from `first` on have not.
fn make_column(mut matrix: MatMut<'_, f64>, first: usize, column: usize, diagonal: f64) {
    let (n_below, n_before) = (matrix.nrows() - column - 1, column - first);
    matrix[(column, column)] = diagonal;
    let (left, right) = matrix.split_at_col_mut(column);
    let before = left.as_ref().subcols(first, n_before);
    let mut below = right.submatrix_mut(column + 1, 0, n_below, 1);
    let row = before.row(column).transpose().as_mat();
    let par = parallelism((2 * n_below * n_before) as f64);
    matmul(below.rb_mut(), Accum::Add, before.subrows(column + 1, n_below), row, -1.0, par);
    (0..n_below).for_each(|k| below[(k, 0)] /= diagonal);
}

/// Subtracts the part of the columns `first..end` of L from the rest of the lower triangle.
fn update(matrix: MatMut<'_, f64>, first: usize, end: usize) {
    let n_rest = matrix.nrows() - end;
    let (left, right) = matrix.split_at_col_mut(end);
    let made = left.as_ref().submatrix(end, first, n_rest, end - first);
    triangular::matmul(
        right.submatrix_mut(end, 0, n_rest, n_rest),
        BlockStructure::TriangularLower,
        Accum::Add,
        made,
        BlockStructure::Rectangular,
        made.transpose(),
        BlockStructure::Rectangular,
        -1.0,
        parallelism((n_rest * n_rest * (end - first)) as f64),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::Unobserved;
    use crate::testing::Random;

    /// Returns `GGᵀ` of a random matrix G, `[m, rank]`.
    fn product(m: usize, rank: usize, random: &mut Random) -> Vec<f64> {
        let g: Vec<f64> = (0..m * rank).map(|_| random.normal()).collect();
        let entry = |i: usize, j: usize| (0..rank).map(|k| g[i * rank + k] * g[j * rank + k]).sum();
        (0..m * m).map(|at| entry(at % m, at / m)).collect()
    }

    #[test]
    fn the_product_of_the_root_is_the_matrix_and_the_rank_is_found() {
        let random = &mut Random(3);
        for (m, rank) in [(1, 1), (5, 5), (64, 64), (150, 150), (150, 70), (200, 3)] {
            let matrix = product(m, rank, random);
            let mut root = matrix.clone();
            let found = PivotedRoot::of(&mut root, m, 1e-9, &Unobserved).unwrap();
            assert_eq!(found.rank, rank);
            let l = |row: usize, column: usize| if row < column { 0.0 } else { root[column * m + row] };
            for i in 0..m {
                for j in 0..=i {
                    let sum: f64 = (0..rank).map(|k| l(i, k) * l(j, k)).sum();
                    let expected = matrix[found.order[j] * m + found.order[i]];
                    // Entries are about `rank` at most, and each sum has `rank` terms.
                    assert!((sum - expected).abs() < 1e-10, "{m} {rank} {i} {j}: {sum} {expected}");
                }
            }
        }
    }
}
