//! Rectangular full packed storage: one triangle of a symmetric matrix in half the memory of the whole.
//!
//! The lower triangle of an `[n, n]` matrix splits into two triangles and a square. The second triangle,
//! transposed, fits above the first one. Together they form a rectangle of h = ⌈n/2⌉ columns (Gustavson,
//! Waśniewski, Dongarra and Langou 2010, "Rectangular full packed format for Cholesky's algorithm"). Here a
//! cache line separates the two triangles:
//!
//! ```text
//! column c:  A[h..=h+c, h+c], rest of n₂ = n − h rows │ … │ A[c..n, c] from position c + GAP on
//! ```
//!
//! Unlike in a packed triangle, all columns are at the same distance, so matrix products on the parts run at
//! full speed.

use std::ops::Range;
use std::sync::Arc;

use faer::{MatMut, MatRef};
use rayon::prelude::*;

use crate::error::{NumericsError, Result};
use crate::kernel::Kernel;
use crate::machine::pages::{Buffer, SpareBuffer};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::regression::sums::gram::fill_kernel_column;
use crate::regression::sums::nodes::Nodes;
use crate::regression::sums::regularization::Regularization;

/// Numbers by which the first triangle is lower than in a full matrix. They fill a cache line, so that
/// columns of both triangles begin on a cache line.
const GAP: usize = 8;

/// Columns per task of the assembly. All columns are equally long.
const COLUMNS_PER_TASK: usize = 8;

/// Parts of the matrix whose column sums are computed side by side, n numbers each.
const NORM_TASKS: usize = 32;

/// A symmetric matrix A, or the lower triangle L of its factor, in rectangular full packed storage.
pub(super) struct PackedMatrix {
    buffer: Buffer,
    n: usize,
}

/// Columns of one of the parts. Entry `[i, j]` is `numbers[j·stride + i]`.
#[derive(Clone, Copy)]
pub(super) struct Columns<'a> {
    numbers: &'a [f64],
    stride: usize,
}

impl<'a> Columns<'a> {
    pub(super) fn new(numbers: &'a [f64], stride: usize) -> Self {
        Self { numbers, stride }
    }

    /// Returns some rows of a column.
    #[inline(always)]
    pub(super) fn column(self, j: usize, rows: Range<usize>) -> &'a [f64] {
        &self.numbers[j * self.stride..][rows]
    }
}

/// A run of entries in one column: those of one point with a contiguous range of points. The diagonal entry
/// `A[point, point]` is the last or the first of them.
struct Run {
    point: usize,
    points: Range<usize>,
    /// Position of the run in the packed column.
    at: usize,
}

impl PackedMatrix {
    /// Returns the number of columns of the rectangle, which is the number of points of the first triangle.
    pub(super) fn n_columns(n: usize) -> usize {
        n.div_ceil(2)
    }

    /// Returns the distance between columns: full cache lines, and not a multiple of 4 KiB. At such a
    /// multiple, all columns would compete for the same cache sets.
    fn stride_for(n: usize) -> usize {
        let stride = (n + GAP).next_multiple_of(8);
        if stride.is_multiple_of(512) { stride + 8 } else { stride }
    }

    /// Returns how many numbers the rectangle of n points has. `None` if the count overflows.
    pub(super) fn n_numbers(n: usize) -> Option<usize> {
        Self::stride_for(n).checked_mul(Self::n_columns(n))
    }

    /// Assembles `K + αI` of a cloud.
    ///
    /// # Errors
    /// `NumericsError::OutOfMemory`, `NumericsError::Cancelled`.
    pub(super) fn gram(
        spare: &Arc<SpareBuffer>,
        cloud: &Cloud,
        kernel: &Kernel,
        regularization: &Regularization,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let n = cloud.n_points();
        let mut this = Self::blank(spare, n)?;
        let (nodes, stride) = (Nodes::of(cloud), this.stride());
        this.buffer.par_chunks_mut(stride * COLUMNS_PER_TASK).enumerate().try_for_each(
            |(task, columns)| {
                observer.checkpoint()?;
                for (k, column) in columns.chunks_exact_mut(stride).enumerate() {
                    let mut end = 0;
                    for run in runs(n, task * COLUMNS_PER_TASK + k) {
                        // Clears what an earlier user of the memory left between the runs.
                        column[end..run.at].fill(0.0);
                        end = run.at + run.points.len();
                        let entries = &mut column[run.at..run.at + run.points.len()];
                        fill_kernel_column(
                            &nodes,
                            kernel,
                            cloud.point(run.point),
                            run.points.clone(),
                            entries,
                        );
                        entries[run.point - run.points.start] += regularization.at(run.point);
                    }
                    column[end..].fill(0.0);
                }
                Ok::<_, NumericsError>(())
            },
        )?;
        Ok(this)
    }

    /// Allocates memory for n points, with arbitrary contents.
    ///
    /// # Errors
    /// `NumericsError::OutOfMemory`.
    pub(super) fn blank(spare: &Arc<SpareBuffer>, n: usize) -> Result<Self> {
        let n_numbers = Self::n_numbers(n).unwrap_or(usize::MAX);
        Ok(Self { buffer: spare.take(n_numbers)?, n })
    }

    /// Returns the rectangle, column by column, including the gaps between its parts.
    pub(super) fn numbers(&self) -> &[f64] {
        &self.buffer
    }

    pub(super) fn numbers_mut(&mut self) -> &mut [f64] {
        &mut self.buffer
    }

    pub(super) fn n_points(&self) -> usize {
        self.n
    }

    fn stride(&self) -> usize {
        Self::stride_for(self.n)
    }

    pub(super) fn n_bytes(&self) -> usize {
        self.buffer.n_bytes()
    }

    /// Returns the memory to the operating system instead of keeping it.
    pub(super) fn discard(self) {
        self.buffer.discard();
    }

    /// Returns the first triangle with the square below it, `[n, h]`. Entries above the diagonal do not
    /// belong to it.
    pub(super) fn first(&self) -> MatRef<'_, f64> {
        let (numbers, stride) = (&self.buffer[GAP..], self.stride());
        MatRef::from_column_major_slice_with_stride(numbers, self.n, Self::n_columns(self.n), stride)
    }

    /// Returns the second triangle, `[n₂, n₂]`, transposed to an upper one.
    pub(super) fn second_transposed(&self) -> MatRef<'_, f64> {
        let n_second = self.n - Self::n_columns(self.n);
        MatRef::from_column_major_slice_with_stride(&self.buffer, n_second, n_second, self.stride())
    }

    /// Returns the columns of [`PackedMatrix::first`].
    pub(super) fn columns_of_first(&self) -> Columns<'_> {
        Columns::new(&self.buffer[GAP..], self.stride())
    }

    /// Returns the columns of [`PackedMatrix::second_transposed`].
    pub(super) fn columns_of_second(&self) -> Columns<'_> {
        Columns::new(&self.buffer, self.stride())
    }

    /// Returns writable views of the first triangle, the square below it, and the second triangle, one at a
    /// time. The triangles share their columns, so a writer must keep to its side of the diagonal.
    pub(super) fn parts_mut(&mut self) -> Parts<'_> {
        let (n, stride) = (self.n, self.stride());
        let n_columns = Self::n_columns(n);
        let all =
            MatMut::from_column_major_slice_with_stride_mut(&mut self.buffer, n + GAP, n_columns, stride);
        let (triangles, square) = all.split_at_row_mut(n_columns + GAP);
        Parts { triangles, square }
    }

    /// Yields the diagonal in the order of the points.
    pub(super) fn diagonal(&self) -> impl Iterator<Item = f64> {
        let (first, second) = (self.first(), self.second_transposed());
        let of_second = (0..second.nrows()).map(move |j| second[(j, j)]);
        (0..first.ncols()).map(move |j| first[(j, j)]).chain(of_second)
    }

    /// Returns `‖A‖₁` of the symmetric matrix. The order of summation does not depend on the number of
    /// threads.
    pub(super) fn norm1(&self) -> f64 {
        let (n, stride) = (self.n, self.stride());
        let n_columns = Self::n_columns(n).div_ceil(NORM_TASKS);
        let partial = |(task, columns): (usize, &[f64])| {
            let mut sums = vec![0.0; n];
            for (k, column) in columns.chunks_exact(stride).enumerate() {
                add_absolute_values(&mut sums, runs(n, task * n_columns + k), column);
            }
            sums
        };
        let partials: Vec<Vec<f64>> =
            self.buffer.par_chunks(stride * n_columns).enumerate().map(partial).collect();
        (0..n).map(|i| partials.iter().map(|sums| sums[i]).sum()).fold(0.0, f64::max)
    }
}

/// Adds the magnitude of every entry to the sums of its row and its column, once each.
fn add_absolute_values(sums: &mut [f64], runs: impl Iterator<Item = Run>, column: &[f64]) {
    for run in runs {
        let entries = &column[run.at..run.at + run.points.len()];
        let mut total = 0.0;
        for (sum, entry) in sums[run.points.clone()].iter_mut().zip(entries) {
            *sum += entry.abs();
            total += entry.abs();
        }
        // The loop has added the diagonal entry already.
        sums[run.point] += total - entries[run.point - run.points.start].abs();
    }
}

/// Yields the runs of a column of the rectangle: that of the second triangle, if any, then that of the first
/// one with the square.
fn runs(n: usize, c: usize) -> impl Iterator<Item = Run> {
    let h = PackedMatrix::n_columns(n);
    let second = (h + c < n).then(|| Run { point: h + c, points: h..h + c + 1, at: 0 });
    let first = Run { point: c, points: c..n, at: c + GAP };
    second.into_iter().chain([first])
}

/// Writable views of the parts of a [`PackedMatrix`].
pub(super) struct Parts<'a> {
    triangles: MatMut<'a, f64>,
    pub square: MatMut<'a, f64>,
}

impl Parts<'_> {
    /// Returns the first triangle, lower. Above its diagonal are numbers of the second one.
    pub(super) fn first(&mut self) -> MatMut<'_, f64> {
        let h = self.triangles.ncols();
        self.triangles.as_mut().submatrix_mut(GAP, 0, h, h)
    }

    /// Returns the second triangle, lower. Above its diagonal are numbers of the first one.
    pub(super) fn second(&mut self) -> MatMut<'_, f64> {
        let n_second = self.square.nrows();
        self.triangles.as_mut().submatrix_mut(0, 0, n_second, n_second).transpose_mut()
    }

    /// Returns the first triangle, lower, to read, and the square to write.
    pub(super) fn first_and_square(&mut self) -> (MatRef<'_, f64>, MatMut<'_, f64>) {
        let h = self.triangles.ncols();
        (self.triangles.as_ref().submatrix(GAP, 0, h, h), self.square.as_mut())
    }

    /// Returns the second triangle, lower, to write, and the square to read.
    pub(super) fn second_and_square(&mut self) -> (MatMut<'_, f64>, MatRef<'_, f64>) {
        let n_second = self.square.nrows();
        let second = self.triangles.as_mut().submatrix_mut(0, 0, n_second, n_second).transpose_mut();
        (second, self.square.as_ref())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Family;
    use crate::observer::Unobserved;
    use crate::testing::fibonacci_sphere;

    #[test]
    fn every_entry_of_the_lower_triangle_has_one_place() {
        for n in [1, 2, 3, 8, 9, 64, 101] {
            let cloud = fibonacci_sphere(n);
            let kernel = Kernel::new(Family::Gauss, 0.7, 2.0).unwrap();
            let alpha = Regularization::per_point((0..n).map(|i| i as f64).collect()).unwrap();
            let spare = SpareBuffer::up_to(0);
            let packed = PackedMatrix::gram(&spare, &cloud, &kernel, &alpha, &Unobserved).unwrap();
            let (h, first, second) = (PackedMatrix::n_columns(n), packed.first(), packed.second_transposed());
            let mut largest_sum: f64 = 0.0;
            for i in 0..n {
                let mut sum = 0.0;
                for j in 0..n {
                    let squared: f64 = (0..3).map(|c| (cloud.point(i)[c] - cloud.point(j)[c]).powi(2)).sum();
                    let expected = 2.0 * (-squared / 0.49).exp() + if i == j { i as f64 } else { 0.0 };
                    let (row, column) = (i.max(j), i.min(j));
                    let found = if column < h { first[(row, column)] } else { second[(column - h, row - h)] };
                    assert!((found - expected).abs() < 1e-14 * expected, "n = {n}: [{i}, {j}]");
                    sum += expected;
                }
                largest_sum = largest_sum.max(sum);
            }
            assert!((packed.norm1() - largest_sum).abs() < 1e-12 * largest_sum);
            let trace: f64 = packed.diagonal().sum();
            assert!((trace - (2 * n + n * (n - 1) / 2) as f64).abs() < 1e-12 * trace);
        }
    }

    #[test]
    fn it_takes_half_the_memory_of_the_whole() {
        for n in [100, 1000, 4000, 20_000] {
            assert!(
                (PackedMatrix::n_numbers(n).unwrap() as f64) < 0.5 * (n * n) as f64 * (1.0 + 20.0 / n as f64)
            );
        }
        assert_eq!(PackedMatrix::n_numbers(usize::MAX / 4), None);
    }
}
