//! Products `Kλ` at the centres themselves.
//!
//! The matrix K is symmetric, so every pair of blocks is evaluated once and serves both.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::nodes::{BlockPairs, Nodes, blocked};
use crate::error::{NumericsError, Result};
use crate::kernel::Kernel;
use crate::machine::registers::{BLOCK, Block, Pack};
use crate::observer::Observer;
use crate::points::cloud::Cloud;

/// Computes `Σ_j λ_j k(x_i, x_j)` at every point of the cloud, `[n]`.
///
/// # Errors
/// [`NumericsError::Overflow`] if a result leaves float64, [`NumericsError::Cancelled`].
pub(crate) fn kernel_times(
    cloud: &Cloud,
    kernel: &Kernel,
    weights: &[f64],
    observer: &dyn Observer,
) -> Result<Vec<f64>> {
    over(&Nodes::of(cloud), cloud, kernel, weights, observer)
}

/// Computes the products of [`kernel_times`] over points that are laid out already.
fn over(
    nodes: &Nodes,
    cloud: &Cloud,
    kernel: &Kernel,
    weights: &[f64],
    observer: &dyn Observer,
) -> Result<Vec<f64>> {
    let weights = blocked(weights);
    let pair = |a: Share<'_>, b: Option<Share<'_>>| {
        nodes.dispatch(BlockPair { nodes, kernel, weights: &weights, cloud, a, b });
    };
    let sums = sum_pairs(weights.len(), 1, pair, observer)?;
    let sums = sums.iter().flat_map(|block| block.0);
    let products: Vec<f64> = sums.take(cloud.n_points()).map(|sum| kernel.variance() * sum).collect();
    match products.iter().position(|x| !x.is_finite()) {
        Some(query) => Err(NumericsError::Overflow { query }),
        None => Ok(products),
    }
}

/// The index of a block of points, with its sums.
pub(crate) type Share<'a> = (usize, &'a mut [Block]);

/// Computes sums `[n_blocks, n_sums]` over all pairs of points, one pair of blocks at a time.
///
/// `pair(a, None)` adds what the points of block a contribute to one another. `pair(a, Some(b))`, `a < b`,
/// adds what the points of two blocks contribute to each other.
///
/// The schedule is that of a tournament: in each round every block meets one other block. So no two tasks
/// write to the same sums. The order in which a block meets the others depends only on the number of blocks.
///
/// # Errors
/// [`NumericsError::Cancelled`].
pub(crate) fn sum_pairs(
    n_blocks: usize,
    n_sums: usize,
    pair: impl Fn(Share<'_>, Option<Share<'_>>) + Sync,
    observer: &dyn Observer,
) -> Result<Vec<Block>> {
    let mut sums = vec![Block::ZERO; n_blocks * n_sums];
    let mut seats: Vec<Option<Share<'_>>> = sums.chunks_exact_mut(n_sums).enumerate().map(Some).collect();
    seats.par_iter_mut().flatten().for_each(|(block, sums)| pair((*block, sums), None));
    if seats.len() % 2 == 1 {
        seats.push(None);
    }
    let half = seats.len() / 2;
    for _ in 1..seats.len() {
        observer.checkpoint()?;
        let (left, right) = seats.split_at_mut(half);
        left.par_iter_mut().zip(right.par_iter_mut().rev()).for_each(|both| {
            // With an odd number of blocks, one sits out.
            let (Some((a, of_a)), Some((b, of_b))) = both else { return };
            if a < b { pair((*a, of_a), Some((*b, of_b))) } else { pair((*b, of_b), Some((*a, of_a))) }
        });
        // All seats but the first move on by one.
        seats[1..].rotate_right(1);
    }
    Ok(sums)
}

/// The pairs between the points of block `a` and those of block `b`, or among those of `a` if `b` is `None`.
struct BlockPair<'a> {
    nodes: &'a Nodes,
    kernel: &'a Kernel,
    weights: &'a [Block],
    cloud: &'a Cloud,
    a: Share<'a>,
    b: Option<Share<'a>>,
}

impl WithSimd for BlockPair<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { nodes, kernel, weights, cloud, a: (row, own), b } = self;
        // Each pair of blocks is summed by itself first: adding n terms one after the other would lose a
        // digit.
        let (mut mirrored, mut profile) = (Block::ZERO, Block::ZERO);
        let block = b.as_ref().map_or(row, |(block, _)| *block);
        for (at, point) in block_points(cloud, row).enumerate() {
            let pairs = BlockPairs { kernel, x: cloud.point(point), block };
            nodes.squared_distances(simd, pairs, &mut profile, &mut []);
            kernel.profiles(simd, [profile.registers_mut::<S>()]);
            let weight = Pack::<S, 1>::splat(simd, weights[row].0[at]);
            let mut sum = Pack::<S, 1>::splat(simd, 0.0);
            for at in 0..Pack::<S, 1>::PER_BLOCK {
                let phi = Pack::load(simd, &profile, at);
                sum = Pack::load(simd, &weights[block], at).mul_add(phi, sum);
                weight.mul_add(phi, Pack::load(simd, &mirrored, at)).store(&mut mirrored, at);
            }
            own[0].0[at] += sum.sum_lanes();
        }
        // Within a single block, both points of a pair have been the point of a row already.
        if let Some((_, sums)) = b {
            sums[0].0.iter_mut().zip(mirrored.0).for_each(|(sum, mirrored)| *sum += mirrored);
        }
    }
}

/// Returns the indices of the points of a block. The last block may have fewer.
pub(crate) fn block_points(cloud: &Cloud, block: usize) -> std::ops::Range<usize> {
    block * BLOCK..cloud.n_points().min((block + 1) * BLOCK)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::instruction_set::InstructionSet;
    use crate::observer::Unobserved;
    use crate::regression::sums::jets::{JetOrder, Jets};
    use crate::testing::{all_families, fibonacci_sphere};

    #[test]
    fn products_are_the_values_at_the_points() {
        // The sizes are less than a block, one block, one block and a point, and an odd number of blocks.
        for n in [1, 128, 129, 600] {
            let cloud = fibonacci_sphere(n);
            let weights: Vec<f64> = (0..n).map(|i| (0.7 * i as f64).cos()).collect();
            for family in all_families() {
                let kernel = Kernel::new(family, 0.8, 1.7).unwrap();
                let order = JetOrder::Value;
                let jets = Jets::evaluate(&cloud, &kernel, &weights, &cloud, order, &Unobserved).unwrap();
                for set in InstructionSet::available() {
                    let nodes = Nodes::on(set, &cloud);
                    let found = over(&nodes, &cloud, &kernel, &weights, &Unobserved).unwrap();
                    // Each sum has n terms of at most 1.7, and profiles differ by a few roundings between
                    // instruction sets.
                    let allowed = 4.0 * f64::EPSILON * 1.7 * n as f64;
                    for (point, found) in found.iter().enumerate() {
                        let close = (found - jets.value(point)).abs() <= allowed;
                        assert!(close, "{family:?}, {point} of {n} on {}", set.name());
                    }
                }
            }
        }
    }

    #[test]
    fn sums_of_many_terms_round_no_more_than_in_the_plain_pass() {
        let cloud = fibonacci_sphere(4000);
        let weights: Vec<f64> = (0..4000).map(|i| 1.5 + (0.7 * i as f64).cos()).collect();
        let kernel = Kernel::new(crate::kernel::Family::Gauss, 1.0, 1.0).unwrap();
        let found = kernel_times(&cloud, &kernel, &weights, &Unobserved).unwrap();
        // The last points are those to which every other block contributes.
        for point in (3900..4000).step_by(7) {
            let terms = cloud.points().zip(&weights).map(|(y, weight)| {
                let q: f64 = cloud.point(point).iter().zip(y).map(|(a, b)| (a - b) * (a - b)).sum();
                weight * (-q).exp()
            });
            // The reference is Kahan's sum of terms that are each within two roundings. These errors scatter,
            // and add up to less than one rounding of the sum.
            let (mut exact, mut lost) = (0.0, 0.0);
            for term in terms {
                let next = exact + (term - lost);
                lost = (next - exact) - (term - lost);
                exact = next;
            }
            // Sums of 128 terms, then of 32 sums, are within 4 ε. Sums of one term after the other were off
            // by up to 10 ε.
            let error = (found[point] - exact).abs() / exact;
            assert!(error <= 4.0 * f64::EPSILON, "{point}: {}", error / f64::EPSILON);
        }
    }

    #[test]
    fn what_leaves_float64_is_refused() {
        let cloud = fibonacci_sphere(3);
        let kernel = Kernel::new(crate::kernel::Family::Gauss, 1.0, 1e140).unwrap();
        let found = kernel_times(&cloud, &kernel, &[1.0, 1e300, 1.0], &Unobserved);
        assert_eq!(found, Err(NumericsError::Overflow { query: 0 }));
    }
}
