//! Pivoted Cholesky factorization in blocks of pivots. Columns of K are evaluated as they are needed.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, MatMut, MatRef};
use rayon::prelude::*;

use crate::error::Result;
use crate::kernel::Kernel;
use crate::machine::parallelism::parallelism;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::regression::sums::gram::fill_cross_gram;
use crate::regression::sums::nodes::Nodes;
use crate::regression::sums::regularization::Regularization;

/// Multiple of k₀ below which a pivot counts as rounding (numerics.md, Fit 2).
pub(crate) const PIVOT_TOLERANCE: f64 = 64.0 * f64::EPSILON;

/// Largest number of candidates of a block, wide enough for matrix products at full speed. Rough kernels
/// accept nearly all candidates.
const CANDIDATES: usize = 128;

/// Share of the largest remaining diagonal entry, as its block begins, that a pivot must reach to be
/// accepted.
///
/// This bounds the entries of `L₂₁L₁₁⁻¹` as strict pivoting does, but by a factor √10 for each pivot instead
/// of 1.
const WORTH: f64 = 0.1;

/// A factorization `P(K + D)Pᵀ ≈ LLᵀ` with r columns in the making, D the regularization.
///
/// A pivot is a point with a large diagonal entry of `K + D − LLᵀ`, as in LAPACK's `dpstrf` (Hammarling,
/// Higham and Lucas 2007). Whole blocks of candidates are taken and weak ones are put back, as Epperly, Tropp
/// and Webber (2024) do for random pivots. Columns of K are evaluated only for pivots (Harbrecht, Peters and
/// Schneider 2012).
///
/// The cost is n r kernel values and `n r² − ⅔r³` flops in matrix products. Besides the n r numbers of L,
/// each thread needs O(n) memory.
pub(in crate::regression::solver) struct Pivoting<'a> {
    cloud: &'a Cloud,
    kernel: &'a Kernel,
    regularization: &'a Regularization,
    nodes: Nodes,
    /// Point of each row: pivots first, in the order of their choice.
    order: Vec<usize>,
    /// Diagonal of `K + D − LLᵀ`, row by row.
    remaining: Vec<f64>,
    /// L column by column, n numbers each. Entries above its diagonal are zero.
    columns: &'a mut [f64],
    rank: usize,
    tolerance: Tolerance,
}

/// Outcome of a block of pivots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::regression::solver) enum Step {
    /// No more remains than is tolerated.
    Complete,
    /// More pivots are needed than fit.
    Full,
    Further,
}

/// Largest diagonal entry that may remain.
#[derive(Debug, Clone, Copy)]
pub(in crate::regression::solver) struct Tolerance {
    /// What counts as rounding, whatever the rank.
    pub(in crate::regression::solver) rounding: f64,
    /// What may remain for each pivot.
    pub(in crate::regression::solver) per_pivot: f64,
    /// What may remain at most, unless it is rounding.
    pub(in crate::regression::solver) most: f64,
}

impl Tolerance {
    /// Only rounding may remain.
    pub(in crate::regression::solver) fn rounding(kernel: &Kernel) -> Self {
        Self { rounding: PIVOT_TOLERANCE * kernel.at_zero(), per_pivot: 0.0, most: 0.0 }
    }

    pub(in crate::regression::solver) fn at(&self, rank: usize) -> f64 {
        self.rounding.max((self.per_pivot * rank as f64).min(self.most))
    }

    /// Returns how far `remaining` has fallen from k₀ to the tolerance at a rank, in logarithms: 0 at k₀, and
    /// 1 at the tolerance or below.
    pub(in crate::regression::solver) fn progress(&self, remaining: f64, rank: usize, k0: f64) -> f64 {
        let tolerance = self.at(rank);
        if remaining <= tolerance {
            return 1.0;
        }
        ((k0 / remaining).ln() / (k0 / tolerance).ln()).clamp(0.0, 1.0)
    }
}

/// The outcome of pivoting. The columns of L are in the buffer.
pub(in crate::regression::solver) struct Pivots {
    /// Point of each row, pivots first.
    pub(in crate::regression::solver) order: Vec<usize>,
    /// Number of pivots.
    pub(in crate::regression::solver) rank: usize,
    /// True if what remains is rounding, false if the pivots did not fit.
    pub(in crate::regression::solver) is_complete: bool,
}

impl<'a> Pivoting<'a> {
    pub(in crate::regression::solver) fn new(
        cloud: &'a Cloud,
        kernel: &'a Kernel,
        regularization: &'a Regularization,
        columns: &'a mut [f64],
    ) -> Self {
        let n = cloud.n_points();
        let remaining = (0..n).map(|point| kernel.at_zero() + regularization.at(point)).collect();
        let order = (0..n).collect();
        let (nodes, tolerance) = (Nodes::of(cloud), Tolerance::rounding(kernel));
        Self { cloud, kernel, regularization, nodes, order, remaining, columns, rank: 0, tolerance }
    }

    /// Ends where as much remains as is tolerated.
    pub(in crate::regression::solver) fn to(self, tolerance: Tolerance) -> Self {
        Self { tolerance, ..self }
    }

    /// Adds pivots until the largest remaining diagonal entry is tolerated, or until more than `max_rank`
    /// would be needed.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(in crate::regression::solver) fn run(
        mut self,
        max_rank: usize,
        observer: &dyn Observer,
    ) -> Result<Pivots> {
        loop {
            let step = self.step(max_rank, observer)?;
            if step != Step::Further {
                let is_complete = step == Step::Complete;
                return Ok(Pivots { order: self.order, rank: self.rank, is_complete });
            }
        }
    }

    /// Adds the pivots of one block, unless the largest remaining diagonal entry is tolerated.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(in crate::regression::solver) fn step(
        &mut self,
        max_rank: usize,
        observer: &dyn Observer,
    ) -> Result<Step> {
        observer.checkpoint()?;
        let (largest, tolerance) = (self.largest_remaining(), self.tolerance.at(self.rank));
        if largest <= tolerance {
            return Ok(Step::Complete);
        }
        let floor = tolerance.max(WORTH * largest);
        let n_candidates = self.gather_candidates(floor);
        let mut block = self.schur_complement(n_candidates, observer)?;
        for k in 0..n_candidates {
            // This number has the rounding of one sum instead of many, so that no candidate comes back
            // forever.
            self.remaining[self.rank + k] = block.diagonal(k);
        }
        let swaps = block.factorize(floor);
        if self.rank + swaps.len() > max_rank {
            return Ok(Step::Full);
        }
        self.swap_rows(&swaps);
        if !swaps.is_empty() {
            self.append(&block, swaps.len(), observer)?;
        }
        Ok(Step::Further)
    }

    /// Number of pivots.
    pub(in crate::regression::solver) fn rank(&self) -> usize {
        self.rank
    }

    /// Largest diagonal entry of `K + D − LLᵀ`.
    pub(in crate::regression::solver) fn largest_remaining(&self) -> f64 {
        self.remaining[self.rank..].iter().copied().fold(0.0, f64::max)
    }

    /// Moves the rows with the largest remaining entries above `floor` behind the pivots. Returns their
    /// number.
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
        let swaps: Vec<(usize, usize)> =
            rows.iter().enumerate().map(|(k, &row)| (k, row - self.rank)).collect();
        self.swap_rows(&swaps);
        rows.len()
    }

    /// Swaps pairs of rows, counted from the first row that is not a pivot.
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

    /// Returns `K + D − LLᵀ` at the first rows that are not pivots.
    fn schur_complement(&self, n_rows: usize, observer: &dyn Observer) -> Result<Block> {
        let (n, first) = (self.order.len(), self.rank);
        let candidates = self.points(first, n_rows)?;
        let mut entries = vec![0.0; n_rows * n_rows];
        fill_cross_gram(&Nodes::of(&candidates), self.kernel, &candidates, &mut entries, observer)?;
        for k in 0..n_rows {
            entries[k * (n_rows + 1)] += self.regularization.at(self.order[first + k]);
        }
        let l = MatRef::from_column_major_slice(&self.columns[..n * first], n, first).subrows(first, n_rows);
        let par = parallelism((2 * n_rows * n_rows * first) as f64);
        let schur = MatMut::from_column_major_slice_mut(&mut entries, n_rows, n_rows);
        matmul(schur, Accum::Add, l, l.transpose(), -1.0, par);
        Ok(Block { entries, n: n_rows })
    }

    /// Appends the columns of the accepted pivots, which are the first rows of a factorized block:
    /// `L₂ = (K₂ − L₂′L₁′ᵀ) L₁⁻ᵀ`. A prime marks entries of earlier columns.
    fn append(&mut self, block: &Block, n_accepted: usize, observer: &dyn Observer) -> Result<()> {
        self.write_kernel_columns(block, n_accepted, observer)?;
        let (n, first, below) = (self.order.len(), self.rank, self.rank + n_accepted);
        let (before, rest) = self.columns.split_at_mut(n * first);
        let (l, new) = (MatRef::from_column_major_slice(before, n, first), &mut rest[..n * n_accepted]);
        let (upper, mut lower) =
            MatMut::from_column_major_slice_mut(&mut *new, n, n_accepted).split_at_row_mut(below);
        let (l1, l2) = (l.subrows(first, n_accepted), l.subrows(below, n - below));
        let par = parallelism((2 * (n - below) * n_accepted * below) as f64);
        matmul(lower.as_mut(), Accum::Add, l2, l1.transpose(), -1.0, par);
        let l1 = upper.as_ref().subrows(first, n_accepted);
        solve_lower_triangular_in_place(l1, lower.transpose_mut(), par);
        for column in new.chunks_exact(n) {
            for (remaining, l) in self.remaining[below..].iter_mut().zip(&column[below..]) {
                *remaining -= l * l;
            }
        }
        self.rank = below;
        Ok(())
    }

    /// Writes the columns of K at accepted pivots behind L, in the order of the rows. The rows of these
    /// pivots get the factor of their block, and the rows above them get zero.
    fn write_kernel_columns(
        &mut self,
        block: &Block,
        n_accepted: usize,
        observer: &dyn Observer,
    ) -> Result<()> {
        let (n, first, below) = (self.order.len(), self.rank, self.rank + n_accepted);
        let pivots = self.points(first, n_accepted)?;
        let new = &mut self.columns[n * first..n * below];
        fill_cross_gram(&self.nodes, self.kernel, &pivots, new, observer)?;
        new.par_chunks_mut(n).enumerate().for_each(|(k, column)| {
            let by_point = column.to_vec();
            column[..first + k].fill(0.0);
            column[first + k..below].copy_from_slice(&block.entries[k * block.n..][k..n_accepted]);
            for (entry, &point) in column[below..].iter_mut().zip(&self.order[below..]) {
                *entry = by_point[point];
            }
        });
        Ok(())
    }

    /// Returns the points of some rows.
    fn points(&self, first: usize, n_rows: usize) -> Result<Cloud> {
        let rows = self.order[first..][..n_rows].iter();
        let coordinates = rows.flat_map(|&point| self.cloud.point(point)).copied().collect();
        Cloud::new(coordinates, self.cloud.dimension())
    }
}

/// A small symmetric matrix, column by column, both triangles.
struct Block {
    entries: Vec<f64>,
    n: usize,
}

impl Block {
    fn diagonal(&self, k: usize) -> f64 {
        self.entries[k * (self.n + 1)]
    }

    /// Factorizes in place, with pivoting, while pivots are above `floor`. Returns the swaps of rows, one for
    /// each column of the factor.
    fn factorize(&mut self, floor: f64) -> Vec<(usize, usize)> {
        let mut swaps = Vec::new();
        for k in 0..self.n {
            let greater = |best, i| if self.diagonal(i) > self.diagonal(best) { i } else { best };
            let pivot = (k..self.n).fold(k, greater);
            let largest = self.diagonal(pivot);
            if largest.is_nan() || largest <= floor {
                break;
            }
            self.swap(k, pivot);
            swaps.push((k, pivot));
            self.eliminate(k);
        }
        swaps
    }

    /// Swaps two rows and the columns with the same indices.
    fn swap(&mut self, a: usize, b: usize) {
        let n = self.n;
        (0..n).for_each(|c| self.entries.swap(c * n + a, c * n + b));
        (0..n).for_each(|r| self.entries.swap(a * n + r, b * n + r));
    }

    /// Turns column k into a column of the factor and updates the columns after it.
    fn eliminate(&mut self, k: usize) {
        let n = self.n;
        let (before, after) = self.entries.split_at_mut((k + 1) * n);
        let column = &mut before[k * n..];
        let root = column[k].sqrt();
        column[k..].iter_mut().for_each(|x| *x /= root);
        column[k] = root;
        for (other, j) in after.chunks_exact_mut(n).zip(k + 1..) {
            let factor = column[j];
            for (x, l) in other[k + 1..].iter_mut().zip(&column[k + 1..]) {
                *x -= factor * l;
            }
        }
    }
}
