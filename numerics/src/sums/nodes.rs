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

    /// Returns `q = |u|²/ℓ²` between x and a pack of points y.
    ///
    /// Here u is the difference `x − y`, stretched as the kernel stretches it. `each(c, u[c])` is called for
    /// every coordinate c, in order.
    #[inline(always)]
    pub(crate) fn scaled_distances<S: Simd>(
        &self,
        simd: S,
        place: PackPlace,
        x: &[f64],
        kernel: &Kernel,
        mut each: impl FnMut(usize, Pack<S>),
    ) -> Pack<S> {
        let PackPlace { block, at } = place;
        let columns = &self.coordinates[block * self.dimension..][..self.dimension];
        let coordinates = columns.iter().zip(x).enumerate();
        let mut sum = Pack::splat(simd, 0.0);
        // Two loops, because a test for each coordinate would take a twentieth of their time.
        match kernel.factors() {
            None => {
                for (c, (column, &x)) in coordinates {
                    let difference = x - Pack::load(simd, column, at);
                    each(c, difference);
                    sum = difference.mul_add(difference, sum);
                }
            }
            Some(factors) => {
                for ((c, (column, &x)), &factor) in coordinates.zip(factors) {
                    let difference = (x - Pack::load(simd, column, at)) * factor;
                    each(c, difference);
                    sum = difference.mul_add(difference, sum);
                }
            }
        }
        sum * kernel.inverse_square_length()
    }
}

/// The place of a pack of points: number `at` of a block.
#[derive(Clone, Copy)]
pub(crate) struct PackPlace {
    pub(crate) block: usize,
    pub(crate) at: usize,
}

/// Lays out one number per point like [`Nodes`], with zeros where the last block is padded.
pub(crate) fn blocked(values: &[f64]) -> Vec<Block> {
    let mut blocks = vec![Block::ZERO; values.len().div_ceil(BLOCK)];
    for (block, chunk) in blocks.iter_mut().zip(values.chunks(BLOCK)) {
        block.0[..chunk.len()].copy_from_slice(chunk);
    }
    blocks
}
