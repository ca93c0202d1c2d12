//! Value, gradient and Hessian of an expansion at its own centres. Every pair of blocks is evaluated once and
//! serves both.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::Layout;
use super::tiles::mirror;
use super::totals::{Expansion, Sums};
use crate::error::{NumericsError, Result};
use crate::machine::registers::{BLOCK, Block};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::regression::sums::symmetric::{Share, block_points, sum_pairs};

/// Greatest dimension of this pass. Beyond it, the sums of a point take more memory and time than the kernel.
pub(super) const MAX_DIMENSION: usize = 3;

/// Least number of points of this pass. Below it there are too few pairs of blocks for all threads.
pub(super) const MIN_POINTS: usize = 8 * BLOCK;

/// Computes value, gradient and Hessian at all points, `[n, layout.width()]`.
///
/// # Errors
/// [`NumericsError::Overflow`], [`NumericsError::Cancelled`].
pub(super) fn jets(
    expansion: Expansion<'_>,
    cloud: &Cloud,
    layout: Layout,
    observer: &dyn Observer,
) -> Result<Vec<f64>> {
    let (n_sums, width) = (layout.n_sums(), layout.width());
    let pair = |a: Share<'_>, b: Option<Share<'_>>| {
        expansion.nodes.dispatch(BlockPair { expansion, cloud, a, b });
    };
    let sums = sum_pairs(expansion.weights.len(), n_sums, pair, observer)?;
    let mut packed = vec![0.0; cloud.n_points() * width];
    packed.par_chunks_mut(width * BLOCK).zip(sums.par_chunks(n_sums)).for_each(|(jets, sums)| {
        let mut numbers = vec![0.0; n_sums];
        for (point, jet) in jets.chunks_exact_mut(width).enumerate() {
            numbers.iter_mut().zip(sums).for_each(|(number, block)| *number = block.0[point]);
            layout.finish(expansion.kernel, &numbers, jet);
        }
    });
    match packed.iter().position(|x| !x.is_finite()) {
        Some(at) => Err(NumericsError::Overflow { query: at / width }),
        None => Ok(packed),
    }
}

/// The pairs between the points of block `a` and those of block `b`, or among those of `a` if `b` is `None`.
struct BlockPair<'a> {
    expansion: Expansion<'a>,
    cloud: &'a Cloud,
    a: Share<'a>,
    b: Option<Share<'a>>,
}

impl WithSimd for BlockPair<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { expansion, cloud, a: (row, own), b: other } = self;
        let d = cloud.dimension();
        let (mut sums, mut numbers) = ([Sums::new(simd, d), Sums::new(simd, d)], vec![0.0; own.len()]);
        // Each pair of blocks is summed by itself first: adding n terms one after the other would lose a
        // digit.
        let mut mirrored = vec![Block::ZERO; own.len()];
        let (block, points) = (other.as_ref().map_or(row, |(block, _)| *block), block_points(cloud, row));
        for first in points.clone().step_by(2) {
            // If there is no second point, its part in the mirrored sums has weight 0.
            let mut weights = [0.0; 2];
            for (k, point) in (first..points.end.min(first + 2)).enumerate() {
                weights[k] = expansion.weights[row].0[point % BLOCK];
                sums[k].clear(simd);
                sums[k].add::<2>(simd, expansion, block, cloud.point(point));
                sums[k].write::<2>(&mut numbers);
                for (own, number) in own.iter_mut().zip(&numbers) {
                    own.0[point % BLOCK] += number;
                }
            }
            if other.is_none() {
                continue;
            }
            let given = [(&sums[0].block, weights[0]), (&sums[1].block, weights[1])];
            match d {
                1 => mirror::<S, 1>(simd, given, &mut mirrored),
                2 => mirror::<S, 2>(simd, given, &mut mirrored),
                _ => mirror::<S, MAX_DIMENSION>(simd, given, &mut mirrored),
            }
        }
        for (sums, mirrored) in other.into_iter().flat_map(|(_, sums)| sums.iter_mut().zip(&mirrored)) {
            sums.0.iter_mut().zip(mirrored.0).for_each(|(sum, mirrored)| *sum += mirrored);
        }
    }
}
