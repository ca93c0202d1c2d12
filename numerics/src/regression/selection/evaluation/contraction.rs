//! Contractions `Σ_ij G_ij ∂k(x_i, x_j)/∂θ` for all parameters θ of a kernel, in one pass over the pairs.
//!
//! Let q = Σ_c D_c²/ℓ_c². Then `∂k/∂ ln v = vφ` and `∂k/∂ ln ℓ_c = −2vφ′D_c²/ℓ_c²`. For Laplace, whose φ
//! depends on q + ε, `∂k/∂ε = vφ′`.

use std::ops::Range;

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use crate::error::Result;
use crate::kernel::{HUGE, Kernel};
use crate::machine::registers::{BLOCK, Block, Pack};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::regression::sums::nodes::{BlockPairs, Nodes};

/// Columns per task. The columns of a triangle differ in length, which many tasks balance.
const COLUMNS_PER_TASK: usize = 16;

/// Weights of the pairs, `G = sM + uwᵀ + wuᵀ`, symmetric.
pub(in crate::regression::selection) struct PairWeights<'a> {
    /// M, `[n, n]`. Only its lower triangle is read.
    pub(in crate::regression::selection) matrix: &'a [f64],
    pub(in crate::regression::selection) scale: f64,
    pub(in crate::regression::selection) left: &'a [f64],
    pub(in crate::regression::selection) right: &'a [f64],
}

impl PairWeights<'_> {
    /// Returns the trace of G.
    pub(in crate::regression::selection) fn trace(&self) -> f64 {
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
pub(in crate::regression::selection) struct Sums {
    /// `Σ G_ij φ`.
    pub(in crate::regression::selection) of_values: f64,
    /// `Σ G_ij φ′`.
    pub(in crate::regression::selection) of_slopes: f64,
    /// `Σ G_ij φ′ q`.
    pub(in crate::regression::selection) of_scaled_slopes: f64,
    /// `Σ G_ij φ′ D_c²/ℓ²`, `[d]`. Empty if not requested.
    pub(in crate::regression::selection) of_axes: Vec<f64>,
}

/// The sums to compute for a kernel on a cloud.
pub(in crate::regression::selection) struct Contraction<'a> {
    pub(in crate::regression::selection) cloud: &'a Cloud,
    pub(in crate::regression::selection) kernel: &'a Kernel,
    pub(in crate::regression::selection) weights: &'a PairWeights<'a>,
    /// Whether sums of single axes are wanted.
    pub(in crate::regression::selection) per_axis: bool,
    /// Whether all work stays on the calling thread.
    pub(in crate::regression::selection) is_alone: bool,
}

impl Contraction<'_> {
    /// Computes the sums.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(in crate::regression::selection) fn sums(&self, observer: &dyn Observer) -> Result<Sums> {
        let (nodes, n) = (&Nodes::of(self.cloud), self.cloud.n_points());
        let task = |task: usize| {
            observer.checkpoint()?;
            let columns = task * COLUMNS_PER_TASK..((task + 1) * COLUMNS_PER_TASK).min(n);
            Ok(nodes.dispatch(Columns { of: self, nodes, columns }))
        };
        let tasks = 0..n.div_ceil(COLUMNS_PER_TASK);
        let parts: Result<Vec<Vec<f64>>> =
            if self.is_alone { tasks.map(task).collect() } else { tasks.into_par_iter().map(task).collect() };
        // Adding in the order of the tasks makes the sum independent of the threads.
        let mut total = vec![0.0; FIXED + self.n_axes()];
        for part in parts? {
            total.iter_mut().zip(&part).for_each(|(total, part)| *total += part);
        }
        let of_axes = total[FIXED..].iter().map(|sum| sum * self.kernel.inverse_square_length()).collect();
        Ok(Sums { of_values: total[0], of_slopes: total[1], of_scaled_slopes: total[2], of_axes })
    }

    fn n_axes(&self) -> usize {
        if self.per_axis { self.cloud.dimension() } else { 0 }
    }
}

/// Number of sums besides those of the axes.
const FIXED: usize = 3;

/// The task that computes the sums over some columns.
struct Columns<'a> {
    of: &'a Contraction<'a>,
    nodes: &'a Nodes,
    columns: Range<usize>,
}

impl WithSimd for Columns<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
        let Self { of, nodes, columns } = self;
        let mut block_sums = BlockSums {
            sums: vec![Block::ZERO; FIXED + of.n_axes()],
            weights: Block::ZERO,
            squares: Block::ZERO,
            profiles: [Block::ZERO; 2],
            differences: vec![Block::ZERO; of.n_axes()],
        };
        for j in columns {
            let x = of.cloud.point(j);
            for block in j / BLOCK..of.cloud.n_points().div_ceil(BLOCK) {
                of.weights.fill(j, block, &mut block_sums.weights);
                block_sums.add(simd, nodes, BlockPairs { kernel: of.kernel, x, block });
            }
        }
        block_sums.sums.iter().map(|sum| sum.0.iter().sum()).collect()
    }
}

/// Sums over the columns so far, and the block of rows at hand.
struct BlockSums {
    sums: Vec<Block>,
    /// Entries of G.
    weights: Block,
    /// `|D|²`.
    squares: Block,
    /// φ and φ′.
    profiles: [Block; 2],
    /// Entries of D, or empty if no sums of single axes are wanted.
    differences: Vec<Block>,
}

impl BlockSums {
    /// Adds the contributions of a block of rows of one column, whose weights are at hand.
    #[inline(always)]
    fn add<S: Simd>(&mut self, simd: S, nodes: &Nodes, pairs: BlockPairs<'_>) {
        let Self { sums, weights, squares, profiles, differences } = self;
        nodes.squared_distances(simd, pairs, squares, differences);
        profiles[0] = *squares;
        pairs.kernel.profiles(simd, profiles.each_mut().map(Block::registers_mut::<S>));
        for at in 0..Pack::<S>::PER_BLOCK {
            let weight = Pack::<S>::load(simd, weights, at);
            let slope = weight * Pack::load(simd, &profiles[1], at);
            // A slope of 0 times an infinite q would be NaN.
            let q = (Pack::load(simd, squares, at) * pairs.kernel.inverse_square_length()).at_most(HUGE);
            add_products(&mut sums[0], at, weight, Pack::load(simd, &profiles[0], at));
            add_products(&mut sums[1], at, slope, Pack::splat(simd, 1.0));
            add_products(&mut sums[2], at, slope, q);
            for (sum, difference) in sums[FIXED..].iter_mut().zip(&*differences) {
                let difference = Pack::load(simd, difference, at);
                add_products(sum, at, slope, (difference * difference).at_most(HUGE));
            }
        }
    }
}

/// Adds `a · b` to pack `at` of a sum, element by element.
#[inline(always)]
fn add_products<S: Simd>(sum: &mut Block, at: usize, a: Pack<S>, b: Pack<S>) {
    a.mul_add(b, Pack::load(a.simd(), sum, at)).store(sum, at);
}
