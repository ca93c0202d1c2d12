//! Gram and cross-Gram matrices, assembled in parallel, column by column.

use std::ops::Range;

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::nodes::{BlockPairs, Nodes};
use super::regularization::Regularization;
use crate::error::Result;
use crate::kernel::Kernel;
use crate::machine::registers::{BLOCK, Block};
use crate::observer::Observer;
use crate::points::cloud::Cloud;

/// Columns per task: enough work to outweigh scheduling, few enough to balance a triangle over many threads.
const COLUMNS_PER_TASK: usize = 16;

/// Writes the lower triangle of `K + αI` into a column-major buffer of n columns, `stride` apart.
///
/// `gram[j·stride + i] = k(x_i, x_j) + [i = j] α_i` for i ≥ j. Entries above the diagonal are left untouched.
///
/// # Errors
/// `NumericsError::Cancelled`.
pub(crate) fn fill_lower_gram(
    cloud: &Cloud,
    kernel: &Kernel,
    regularization: &Regularization,
    gram: &mut [f64],
    stride: usize,
    observer: &dyn Observer,
) -> Result<()> {
    let (nodes, n) = (Nodes::of(cloud), cloud.n_points());
    gram.par_chunks_mut(stride * COLUMNS_PER_TASK).enumerate().try_for_each(|(task, columns)| {
        observer.checkpoint()?;
        for (k, column) in columns.chunks_mut(stride).enumerate() {
            let point = task * COLUMNS_PER_TASK + k;
            fill_kernel_column(&nodes, kernel, cloud.point(point), point..n, &mut column[point..n]);
            column[point] += regularization.at(point);
        }
        Ok(())
    })
}

/// Copies the lower triangle of `[n, n]` to the upper one.
pub(crate) fn mirror(matrix: &mut [f64], n: usize) {
    for j in 0..n {
        for i in 0..j {
            matrix[j * n + i] = matrix[i * n + j];
        }
    }
}

/// Writes `out[i − points.start] = k(x_i, x)` for a range of points.
pub(crate) fn fill_kernel_column(
    nodes: &Nodes,
    kernel: &Kernel,
    x: &[f64],
    points: Range<usize>,
    out: &mut [f64],
) {
    nodes.dispatch(KernelColumn { nodes, kernel, x, points, out });
}

/// Writes the cross-Gram matrix `[m, n]` row by row, i.e. one query after the other.
///
/// `cross[j·n + i] = k(x_i, q_j)`.
///
/// # Errors
/// `NumericsError::Cancelled`.
pub fn fill_cross_gram(
    nodes: &Nodes,
    kernel: &Kernel,
    queries: &Cloud,
    cross: &mut [f64],
    observer: &dyn Observer,
) -> Result<()> {
    let n = nodes.n_points();
    cross.par_chunks_mut(n * COLUMNS_PER_TASK).enumerate().try_for_each(|(task, rows)| {
        observer.checkpoint()?;
        for (k, column) in rows.chunks_mut(n).enumerate() {
            let x = queries.point(task * COLUMNS_PER_TASK + k);
            fill_kernel_column(nodes, kernel, x, 0..n, column);
        }
        Ok(())
    })
}

/// The work of [`fill_kernel_column`].
struct KernelColumn<'a> {
    nodes: &'a Nodes,
    kernel: &'a Kernel,
    x: &'a [f64],
    points: Range<usize>,
    out: &'a mut [f64],
}

impl WithSimd for KernelColumn<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut values = Block::ZERO;
        let Self { kernel, x, .. } = self;
        let (from, to, variance) = (self.points.start, self.points.end, kernel.variance());
        for block in from / BLOCK..to.div_ceil(BLOCK) {
            self.nodes.squared_distances(simd, BlockPairs { kernel, x, block }, &mut values, &mut []);
            kernel.profiles(simd, [values.registers_mut::<S>()]);
            let start = block * BLOCK;
            let (first, end) = (from.max(start), to.min(start + BLOCK));
            let out = self.out[first - from..end - from].iter_mut();
            out.zip(&values.0[first - start..]).for_each(|(out, phi)| *out = variance * phi);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::Unobserved;
    use crate::testing::{all_families, fibonacci_sphere};

    #[test]
    fn the_gram_matrix_is_the_cross_gram_of_the_cloud_with_itself_plus_alpha() {
        let cloud = fibonacci_sphere(150);
        let (n, stride) = (150, 152);
        for family in all_families() {
            let kernel = Kernel::new(family, 0.7, 2.0).unwrap();
            let alpha = Regularization::per_point((0..n).map(|i| i as f64).collect()).unwrap();
            let mut gram = vec![f64::NAN; n * stride];
            fill_lower_gram(&cloud, &kernel, &alpha, &mut gram, stride, &Unobserved).unwrap();
            let mut cross = vec![f64::NAN; n * n];
            fill_cross_gram(&Nodes::of(&cloud), &kernel, &cloud, &mut cross, &Unobserved).unwrap();
            for j in 0..n {
                for i in j..n {
                    let expected = cross[j * n + i] + if i == j { i as f64 } else { 0.0 };
                    assert_eq!(gram[j * stride + i], expected);
                    assert_eq!(cross[j * n + i], cross[i * n + j], "symmetric");
                }
                assert!((cross[j * n + j] - kernel.at_zero()).abs() <= 4.0 * f64::EPSILON * kernel.at_zero());
            }
        }
    }
}
