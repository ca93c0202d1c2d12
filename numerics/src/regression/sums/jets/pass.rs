//! Sums over all points for some consecutive queries, block by block.

use pulp::{Simd, WithSimd};

use super::totals::{Expansion, Sums};
use super::{JetOrder, Layout};
use crate::points::cloud::Cloud;

/// A pass that computes the jets of the queries from `first` on.
pub(super) struct Pass<'a> {
    pub(super) expansion: Expansion<'a>,
    pub(super) queries: &'a Cloud,
    pub(super) first: usize,
    pub(super) jets: &'a mut [f64],
    pub(super) layout: Layout,
}

impl WithSimd for Pass<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match self.layout.order {
            JetOrder::Value => self.run::<S, 0>(simd),
            JetOrder::Gradient => self.run::<S, 1>(simd),
            JetOrder::Hessian | JetOrder::HessianWithMagnitudes => self.run::<S, 2>(simd),
        }
    }
}

impl Pass<'_> {
    #[inline(always)]
    fn run<S: Simd, const ORDER: usize>(self, simd: S) {
        let Self { expansion, queries, first, jets, layout } = self;
        let (kernel, has_magnitudes) = (expansion.kernel, layout.order == JetOrder::HessianWithMagnitudes);
        let mut sums = Sums::new(simd, layout.dimension);
        let mut numbers = vec![0.0; layout.n_sums()];
        for (k, jet) in jets.chunks_exact_mut(layout.width()).enumerate() {
            let x = queries.point(first + k);
            sums.clear(simd);
            for block in 0..expansion.weights.len() {
                sums.add::<ORDER>(simd, expansion, block, x);
                if has_magnitudes {
                    sums.add_magnitudes(simd, &expansion.weights[block], kernel);
                }
            }
            sums.write::<ORDER>(&mut numbers);
            let (jet, magnitudes) = jet.split_at_mut(jet.len() - if has_magnitudes { 2 } else { 0 });
            layout.finish(kernel, &numbers, jet);
            if let [value, slope] = magnitudes {
                let (variance, inverse) = (kernel.variance(), 1.0 / kernel.length_scale());
                *value = variance * sums.magnitudes[0].sum_lanes();
                *slope = 2.0 * variance * sums.magnitudes[1].sum_lanes() * inverse;
            }
        }
    }
}
