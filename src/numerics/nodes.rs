//! The points of a cloud laid out for the kernel loops.

use pulp::Simd;

use super::cloud::Cloud;
use super::kernel::Kernel;
use super::simd::{BLOCK, Block, fma};

/// Points in blocks of [`BLOCK`], each block coordinate by coordinate: `[n / BLOCK][d][BLOCK]`.
///
/// The last block is padded with copies of the last point; whoever sums over it gives them weight 0.
pub(crate) struct Nodes {
    coordinates: Vec<Block>,
    n_points: usize,
    dimension: usize,
}

impl Nodes {
    pub(crate) fn of(cloud: &Cloud) -> Self {
        let (n_points, dimension) = (cloud.n_points(), cloud.dimension());
        let mut coordinates = vec![[0.0; BLOCK]; n_points.div_ceil(BLOCK) * dimension];
        for (block, columns) in coordinates.chunks_exact_mut(dimension).enumerate() {
            for i in 0..BLOCK {
                let point = cloud.point((block * BLOCK + i).min(n_points - 1));
                for (column, &x) in columns.iter_mut().zip(point) {
                    column[i] = x;
                }
            }
        }
        Self { coordinates, n_points, dimension }
    }

    pub(crate) fn n_points(&self) -> usize {
        self.n_points
    }

    pub(crate) fn dimension(&self) -> usize {
        self.dimension
    }

    /// Writes `differences[c] = x[c] − y[c]` and `q = |x − y|²/ℓ²` for the points y of a block.
    #[inline(always)]
    pub(crate) fn differences<S: Simd>(
        &self,
        block: usize,
        x: &[f64],
        kernel: &Kernel,
        differences: &mut [Block],
        q: &mut Block,
    ) {
        let mut sums = [0.0; BLOCK];
        let columns = &self.coordinates[block * self.dimension..][..self.dimension];
        for ((column, &x), difference) in columns.iter().zip(x).zip(differences) {
            for i in 0..BLOCK {
                difference[i] = x - column[i];
                sums[i] = fma::<S>(difference[i], difference[i], sums[i]);
            }
        }
        // Dividing twice keeps ℓ² out of float64's way: ℓ = 1e-140 is a legal length scale.
        let inverse = 1.0 / kernel.length_scale();
        for i in 0..BLOCK {
            q[i] = sums[i] * inverse * inverse;
        }
    }

    /// Writes `q = |x − y|²/ℓ²` alone.
    #[inline(always)]
    pub(crate) fn scaled_distances<S: Simd>(&self, block: usize, x: &[f64], kernel: &Kernel, q: &mut Block) {
        let mut sums = [0.0; BLOCK];
        let columns = &self.coordinates[block * self.dimension..][..self.dimension];
        for (column, &x) in columns.iter().zip(x) {
            for i in 0..BLOCK {
                let difference = x - column[i];
                sums[i] = fma::<S>(difference, difference, sums[i]);
            }
        }
        let inverse = 1.0 / kernel.length_scale();
        for i in 0..BLOCK {
            q[i] = sums[i] * inverse * inverse;
        }
    }
}

/// One number per point in the layout of [`Nodes`], zero where the last block is padded.
pub(crate) fn blocked(values: &[f64]) -> Vec<Block> {
    let mut blocks = vec![[0.0; BLOCK]; values.len().div_ceil(BLOCK)];
    for (block, chunk) in blocks.iter_mut().zip(values.chunks(BLOCK)) {
        block[..chunk.len()].copy_from_slice(chunk);
    }
    blocks
}
