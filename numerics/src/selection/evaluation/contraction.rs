//! Contractions `Σ_ij G_ij ∂k(x_i, x_j)/∂θ` for all parameters θ of a kernel, in one pass over the pairs.
//!
//! Let q = Σ_c D_c²/ℓ_c². Then `∂k/∂ ln v = vφ` and `∂k/∂ ln ℓ_c = −2vφ′D_c²/ℓ_c²`. For Laplace, whose φ
//! depends on q + ε, `∂k/∂ε = vφ′`.

use std::ops::Range;

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use crate::error::NumericsError;
use crate::kernel::{HUGE, Kernel, Pairs};
use crate::machine::registers::{BLOCK, Block, Pack};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::sums::nodes::Nodes;

/// Columns per task. The columns of a triangle differ in length, which many tasks balance.
const COLUMNS_PER_TASK: usize = 16;

/// Weights of the pairs, `G = sM + uwᵀ + wuᵀ`, symmetric.
pub(in crate::selection) struct PairWeights<'a> {
    /// M, `[n, n]`. Only its lower triangle is read.
    pub(in crate::selection) matrix: &'a [f64],
    pub(in crate::selection) scale: f64,
    pub(in crate::selection) left: &'a [f64],
    pub(in crate::selection) right: &'a [f64],
}

impl PairWeights<'_> {
    /// Returns the trace of G.
    pub(in crate::selection) fn trace(&self) -> f64 {
        let n = self.left.len();
        (0..n).map(|i| self.scale * self.matrix[i * n + i] + 2.0 * self.left[i] * self.right[i]).sum()
    }

    /// Writes a block of column j of G. Entries below the diagonal are doubled, since they stand for both
    /// triangles. Entries above the diagonal and beyond the last point are 0.
    #[inline(always)]
    fn fill(&self, j: usize, block: usize, out: &mut Block) {
        let n = self.left.len();
        let start = block * BLOCK;
        let (first, end) = (j.max(start), n.min(start + BLOCK));
        let (of_left, of_right) = (2.0 * self.right[j], 2.0 * self.left[j]);
        out.0[..first - start].fill(0.0);
        out.0[end - start..].fill(0.0);
        let rows = self.matrix[j * n + first..j * n + end].iter();
        let vectors = self.left[first..end].iter().zip(&self.right[first..end]);
        for (out, (entry, (u, w))) in out.0[first - start..].iter_mut().zip(rows.zip(vectors)) {
            *out = 2.0 * self.scale * entry + of_left * u + of_right * w;
        }
        if first == j {
            out.0[j - start] *= 0.5;
        }
    }
}

/// Sums over all pairs of points.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::selection) struct Sums {
    /// `Σ G_ij φ`.
    pub(in crate::selection) of_values: f64,
    /// `Σ G_ij φ′`.
    pub(in crate::selection) of_slopes: f64,
    /// `Σ G_ij φ′ q`.
    pub(in crate::selection) of_scaled_slopes: f64,
    /// `Σ G_ij φ′ D_c²/ℓ²`, `[d]`. Empty if not requested.
    pub(in crate::selection) of_axes: Vec<f64>,
}

/// Computes the sums for a kernel on a cloud, those of single axes only if `per_axis`. If `is_alone`, all
/// work stays on the calling thread.
///
/// # Errors
/// [`NumericsError::Cancelled`].
pub(in crate::selection) fn contract(
    (cloud, kernel): (&Cloud, &Kernel),
    weights: &PairWeights<'_>,
    per_axis: bool,
    is_alone: bool,
    observer: &dyn Observer,
) -> Result<Sums, NumericsError> {
    let (nodes, n) = (Nodes::of(cloud), cloud.n_points());
    let task = |task: usize| {
        observer.checkpoint()?;
        let columns = task * COLUMNS_PER_TASK..((task + 1) * COLUMNS_PER_TASK).min(n);
        Ok(nodes.dispatch(Columns { nodes: &nodes, cloud, kernel, weights, columns, per_axis }))
    };
    let tasks = 0..n.div_ceil(COLUMNS_PER_TASK);
    let parts: Result<Vec<Vec<f64>>, NumericsError> =
        if is_alone { tasks.map(task).collect() } else { tasks.into_par_iter().map(task).collect() };
    // Adding in the order of the tasks makes the sum independent of the threads.
    let mut total = vec![0.0; FIXED + if per_axis { cloud.dimension() } else { 0 }];
    for part in parts? {
        total.iter_mut().zip(&part).for_each(|(total, part)| *total += part);
    }
    let of_axes = total[FIXED..].iter().map(|sum| sum * kernel.inverse_square_length()).collect();
    Ok(Sums { of_values: total[0], of_slopes: total[1], of_scaled_slopes: total[2], of_axes })
}

/// Number of sums besides those of the axes.
const FIXED: usize = 3;

/// The task that computes the sums over some columns.
struct Columns<'a> {
    nodes: &'a Nodes,
    cloud: &'a Cloud,
    kernel: &'a Kernel,
    weights: &'a PairWeights<'a>,
    columns: Range<usize>,
    per_axis: bool,
}

impl WithSimd for Columns<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
        let n_axes = if self.per_axis { self.cloud.dimension() } else { 0 };
        let mut sums = vec![Block::ZERO; FIXED + n_axes];
        let (mut differences, mut weights) = (vec![Block::ZERO; n_axes], Block::ZERO);
        for j in self.columns.clone() {
            let x = self.cloud.point(j);
            for block in j / BLOCK..self.cloud.n_points().div_ceil(BLOCK) {
                self.weights.fill(j, block, &mut weights);
                self.kernel.profiles(ColumnPairs {
                    simd,
                    of: &self,
                    block,
                    x,
                    weights: &weights,
                    differences: &mut differences,
                    sums: &mut sums,
                });
            }
        }
        sums.iter().map(|sum| sum.0.iter().sum()).collect()
    }
}

/// A block of rows of one column.
struct ColumnPairs<'a, 'b, S> {
    simd: S,
    of: &'a Columns<'b>,
    block: usize,
    x: &'a [f64],
    weights: &'a Block,
    differences: &'a mut [Block],
    sums: &'a mut [Block],
}

impl<S: Simd> ColumnPairs<'_, '_, S> {
    /// Adds `a · b` to a sum, element by element.
    #[inline(always)]
    fn add(&mut self, sum: usize, at: usize, a: Pack<S>, b: Pack<S>) {
        let sum = &mut self.sums[sum];
        a.mul_add(b, Pack::load(self.simd, sum, at)).store(sum, at);
    }
}

impl<S: Simd> Pairs<S> for ColumnPairs<'_, '_, S> {
    /// The scaled squared distances q.
    type Others = Pack<S>;

    #[inline(always)]
    fn pack(&mut self, at: usize) -> (Pack<S>, Pack<S>) {
        let Columns { nodes, kernel, .. } = *self.of;
        let at_block = (self.block, at);
        let q = if self.differences.is_empty() {
            nodes.scaled_distances(self.simd, at_block, self.x, kernel, |_, _| ())
        } else {
            // The closure must stay this small: a larger one is not inlined, which turns every instruction
            // into a call.
            let differences = &mut *self.differences;
            nodes.scaled_distances(self.simd, at_block, self.x, kernel, |c, difference| {
                difference.store(&mut differences[c], at);
            })
        };
        // A slope of 0 times an infinite q would be NaN.
        (q, q.at_most(HUGE))
    }

    #[inline(always)]
    fn take(&mut self, at: usize, q: Pack<S>, [value, slope, _]: [Pack<S>; 3]) {
        let weight = Pack::load(self.simd, self.weights, at);
        let slope = weight * slope;
        self.add(0, at, weight, value);
        self.add(1, at, slope, Pack::splat(self.simd, 1.0));
        self.add(2, at, slope, q);
        for c in 0..self.differences.len() {
            let difference = Pack::load(self.simd, &self.differences[c], at);
            self.add(FIXED + c, at, slope, (difference * difference).at_most(HUGE));
        }
    }
}
