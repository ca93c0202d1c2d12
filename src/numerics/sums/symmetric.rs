//! `Kλ` at the centres themselves: the matrix is symmetric, so every pair of blocks is evaluated once and serves both.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use super::nodes::{Nodes, blocked};
use crate::numerics::error::NumericsError;
use crate::numerics::kernel::{Kernel, Pairs};
use crate::numerics::machine::registers::{BLOCK, Block, Pack};
use crate::numerics::observer::Observer;
use crate::numerics::points::cloud::Cloud;

/// Strips of rows whose sums are kept apart and added in order, so that the result does not depend on the number of threads.
pub(crate) const N_STRIPS: usize = 16;

/// `Σ_j λ_j k(x_i, x_j)` at every point of the cloud, `[n]`.
///
/// # Errors
/// [`NumericsError::Overflow`] where a result leaves float64, [`NumericsError::Cancelled`].
pub(crate) fn kernel_times(
    cloud: &Cloud,
    kernel: &Kernel,
    weights: &[f64],
    observer: &dyn Observer,
) -> Result<Vec<f64>, NumericsError> {
    let (nodes, weights) = (Nodes::of(cloud), blocked(weights));
    let strip = |first: usize| {
        let mut sums = vec![Block::ZERO; weights.len()];
        for row in (first..weights.len()).step_by(N_STRIPS) {
            observer.checkpoint()?;
            nodes.dispatch(RowBlock {
                nodes: &nodes,
                kernel,
                weights: &weights,
                cloud,
                row,
                sums: &mut sums,
            });
        }
        Ok(sums)
    };
    let n_strips = N_STRIPS.min(weights.len());
    let strips: Vec<Vec<Block>> =
        (0..n_strips).into_par_iter().map(strip).collect::<Result<_, NumericsError>>()?;
    let at = |point: usize| strips.iter().map(|sums| sums[point / BLOCK].0[point % BLOCK]).sum::<f64>();
    let products: Vec<f64> = (0..cloud.n_points()).map(|point| kernel.variance() * at(point)).collect();
    match products.iter().position(|x| !x.is_finite()) {
        Some(query) => Err(NumericsError::Overflow { query }),
        None => Ok(products),
    }
}

/// The pairs of the points of one block with those of that block and all behind it.
struct RowBlock<'a> {
    nodes: &'a Nodes,
    kernel: &'a Kernel,
    weights: &'a [Block],
    cloud: &'a Cloud,
    row: usize,
    sums: &'a mut [Block],
}

impl WithSimd for RowBlock<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { nodes, kernel, weights, cloud, row, sums } = self;
        let start = row * BLOCK;
        for point in start..cloud.n_points().min(start + BLOCK) {
            let (x, weight) = (cloud.point(point), weights[row].0[point - start]);
            let mut sum = Pack::<S, 1>::splat(simd, 0.0);
            for block in row..weights.len() {
                let (others, sum, mirrored) = (&weights[block], &mut sum, &mut sums[block]);
                let position = (nodes, kernel, x, block);
                if block == row {
                    kernel.profiles(Row::<S, false> { simd, position, weight, others, sum, mirrored });
                } else {
                    kernel.profiles(Row::<S, true> { simd, position, weight, others, sum, mirrored });
                }
            }
            sums[row].0[point - start] += sum.sum_lanes();
        }
    }
}

/// One point with a block: its own sum, and where the block is another than its own that of each point there.
struct Row<'a, S: Simd, const IS_MIRRORED: bool> {
    simd: S,
    position: (&'a Nodes, &'a Kernel, &'a [f64], usize),
    weight: f64,
    others: &'a Block,
    sum: &'a mut Pack<S, 1>,
    mirrored: &'a mut Block,
}

impl<S: Simd, const IS_MIRRORED: bool> Pairs<S> for Row<'_, S, IS_MIRRORED> {
    type Others = ();

    #[inline(always)]
    fn pack(&mut self, at: usize) -> (Pack<S>, ()) {
        let (nodes, kernel, x, block) = self.position;
        (nodes.scaled_distances(self.simd, (block, at), x, kernel, |_, _| ()), ())
    }

    #[inline(always)]
    fn take(&mut self, at: usize, (): (), [phi, ..]: [Pack<S>; 3]) {
        let others = Pack::load(self.simd, self.others, at);
        *self.sum = *self.sum + (others * phi).sum_registers();
        if IS_MIRRORED {
            let own = Pack::splat(self.simd, self.weight);
            own.mul_add(phi, Pack::load(self.simd, self.mirrored, at)).store(self.mirrored, at);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::observer::Unobserved;
    use crate::numerics::sums::jets::{JetOrder, Jets};
    use crate::numerics::testing::{all_families, fibonacci_sphere};

    #[test]
    fn products_are_the_values_at_the_points() {
        // Less than a block, one, one and a point, and more row blocks than strips.
        for n in [1, 128, 129, 2500] {
            let cloud = fibonacci_sphere(n);
            let weights: Vec<f64> = (0..n).map(|i| (0.7 * i as f64).cos()).collect();
            for family in all_families() {
                let kernel = Kernel::new(family, 0.8, 1.7).unwrap();
                let found = kernel_times(&cloud, &kernel, &weights, &Unobserved).unwrap();
                let order = JetOrder::Value;
                let jets = Jets::evaluate(&cloud, &kernel, &weights, &cloud, order, &Unobserved).unwrap();
                // Each sum has n terms of at most 1.7.
                let allowed = 4.0 * f64::EPSILON * 1.7 * n as f64;
                for (point, found) in found.iter().enumerate() {
                    assert!((found - jets.value(point)).abs() <= allowed, "{family:?}, {point} of {n}");
                }
            }
        }
    }

    #[test]
    fn what_leaves_float64_is_refused() {
        let cloud = fibonacci_sphere(3);
        let kernel = Kernel::new(crate::numerics::kernel::Family::Gauss, 1.0, 1e140).unwrap();
        let found = kernel_times(&cloud, &kernel, &[1.0, 1e300, 1.0], &Unobserved);
        assert_eq!(found, Err(NumericsError::Overflow { query: 0 }));
    }
}
