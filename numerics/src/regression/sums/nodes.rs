//! The points of a cloud laid out for the kernel loops.

use pulp::{Simd, WithSimd};

use crate::kernel::Kernel;
use crate::machine::instruction_set::InstructionSet;
use crate::machine::registers::{BLOCK, Block, Pack};
use crate::points::cloud::Cloud;

/// The points of a cloud in blocks of `BLOCK`, each block coordinate by coordinate: `[n / BLOCK][d][BLOCK]`.
///
/// It also holds the instruction set for the loops over the points. The last block is padded with copies of
/// the last point. Sums must give these copies weight 0.
pub struct Nodes {
    coordinates: Vec<Block>,
    n_points: usize,
    dimension: usize,
    instruction_set: InstructionSet,
}

impl Nodes {
    /// Lays out a cloud for the best instruction set of this machine.
    pub fn of(cloud: &Cloud) -> Self {
        Self::on(InstructionSet::best(), cloud)
    }

    /// Lays out a cloud for an instruction set.
    pub fn on(instruction_set: InstructionSet, cloud: &Cloud) -> Self {
        let (n_points, dimension) = (cloud.n_points(), cloud.dimension());
        let mut coordinates = vec![Block::ZERO; n_points.div_ceil(BLOCK) * dimension];
        for (block, columns) in coordinates.chunks_exact_mut(dimension).enumerate() {
            for i in 0..BLOCK {
                let point = cloud.point((block * BLOCK + i).min(n_points - 1));
                for (column, &x) in columns.iter_mut().zip(point) {
                    column.0[i] = x;
                }
            }
        }
        Self { coordinates, n_points, dimension, instruction_set }
    }

    pub(crate) fn n_points(&self) -> usize {
        self.n_points
    }

    pub(crate) fn dimension(&self) -> usize {
        self.dimension
    }

    #[inline(always)]
    pub(crate) fn dispatch<Op: WithSimd>(&self, op: Op) -> Op::Output {
        self.instruction_set.dispatch(op)
    }

    /// Returns `|u|²` for the pairs of a query with pack `at` of a block, unit L².
    ///
    /// Here u is the difference `x − y` of query and point, stretched as the kernel stretches it. `take` is
    /// called with each coordinate and the entries of u along it.
    #[inline(always)]
    pub(crate) fn squared_distances_of_pack<S: Simd>(
        &self,
        simd: S,
        BlockPairs { kernel, x, block }: BlockPairs<'_>,
        at: usize,
        mut take: impl FnMut(usize, Pack<S>),
    ) -> Pack<S> {
        let columns = &self.coordinates[block * self.dimension..][..self.dimension];
        let coordinates = columns.iter().zip(x).enumerate();
        let mut sum = Pack::<S>::splat(simd, 0.0);
        // Two loops, because a test for each coordinate would take a twentieth of their time.
        match kernel.factors() {
            None => {
                for (c, (column, &x)) in coordinates {
                    let difference = x - Pack::load(simd, column, at);
                    take(c, difference);
                    sum = difference.mul_add(difference, sum);
                }
            }
            Some(factors) => {
                for ((c, (column, &x)), &factor) in coordinates.zip(factors) {
                    let difference = (x - Pack::load(simd, column, at)) * factor;
                    take(c, difference);
                    sum = difference.mul_add(difference, sum);
                }
            }
        }
        sum
    }

    /// Writes `|u|²` for the pairs of a query with a block, unit L², with u as in
    /// [`Nodes::squared_distances_of_pack`]. `differences` takes the entries of u, one block each, or is
    /// empty.
    #[inline(always)]
    pub(crate) fn squared_distances<S: Simd>(
        &self,
        simd: S,
        pairs: BlockPairs<'_>,
        squares: &mut Block,
        differences: &mut [Block],
    ) {
        for at in 0..Pack::<S>::PER_BLOCK {
            let sum = self.squared_distances_of_pack(simd, pairs, at, |c, difference| {
                if !differences.is_empty() {
                    difference.store(&mut differences[c], at);
                }
            });
            sum.store(squares, at);
        }
    }
}

/// The pairs of a query with a block of points.
#[derive(Clone, Copy)]
pub(crate) struct BlockPairs<'a> {
    pub(crate) kernel: &'a Kernel,
    /// The query, `[d]`.
    pub(crate) x: &'a [f64],
    /// Index of the block.
    pub(crate) block: usize,
}

/// Lays out one number per point like [`Nodes`], with zeros where the last block is padded.
pub(crate) fn blocked(values: &[f64]) -> Vec<Block> {
    let mut blocks = vec![Block::ZERO; values.len().div_ceil(BLOCK)];
    for (block, chunk) in blocks.iter_mut().zip(values.chunks(BLOCK)) {
        block.0[..chunk.len()].copy_from_slice(chunk);
    }
    blocks
}
