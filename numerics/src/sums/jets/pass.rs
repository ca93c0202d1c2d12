//! Sums over all points for some consecutive queries, block by block.

use pulp::{Simd, WithSimd};

use super::tiles::{ProfileBlock, Sum};
use super::{JetOrder, Layout};
use crate::kernel::Kernel;
use crate::machine::registers::Block;
use crate::points::cloud::Cloud;
use crate::sums::nodes::{BlockPairs, Nodes};

/// The function `Σ_j λ_j k(·, x_j)`, with points and weights laid out in blocks.
#[derive(Clone, Copy)]
pub(super) struct Expansion<'a> {
    pub(super) nodes: &'a Nodes,
    pub(super) kernel: &'a Kernel,
    pub(super) weights: &'a [Block],
}

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

/// The sums of a pass for one query, and the block at hand.
pub(super) struct Sums<S: Simd> {
    /// `Σλφ`.
    pub(super) value: Sum<S>,
    /// `Σλφ′`, which enters the whole diagonal of the Hessian.
    pub(super) trace: Sum<S>,
    /// `Σ|λ|φ` and `Σ|λφ′|√q`.
    pub(super) magnitudes: [Sum<S>; 2],
    /// `Σλφ′D_a`.
    pub(super) gradient: Vec<Sum<S>>,
    /// `Σλφ″D_aD_b`, a ≤ b, row by row.
    pub(super) hessian: Vec<Sum<S>>,
    pub(super) block: ProfileBlock,
}

impl<S: Simd> Sums<S> {
    #[inline(always)]
    pub(super) fn new(simd: S, d: usize) -> Self {
        let zero = Sum::splat(simd, 0.0);
        Self {
            value: zero,
            trace: zero,
            magnitudes: [zero; 2],
            gradient: vec![zero; d],
            hessian: vec![zero; d * (d + 1) / 2],
            block: ProfileBlock::zero(d),
        }
    }

    #[inline(always)]
    pub(super) fn clear(&mut self, simd: S) {
        let zero = Sum::splat(simd, 0.0);
        (self.value, self.trace, self.magnitudes) = (zero, zero, [zero; 2]);
        self.gradient.fill(zero);
        self.hessian.fill(zero);
    }

    /// Adds the contributions of the points of a block to the sums at x.
    #[inline(always)]
    pub(super) fn add<const ORDER: usize>(
        &mut self,
        simd: S,
        expansion: Expansion<'_>,
        block: usize,
        x: &[f64],
    ) {
        let Expansion { nodes, kernel, weights } = expansion;
        self.block.fill::<S, ORDER>(simd, nodes, BlockPairs { kernel, x, block });
        self.add_block::<ORDER>(simd, &weights[block]);
    }

    /// Writes the sums up to an order, in the sequence that [`Layout::finish`] takes.
    #[inline(always)]
    pub(super) fn write<const ORDER: usize>(&self, numbers: &mut [f64]) {
        let d = self.gradient.len();
        numbers[0] = self.value.sum_lanes();
        if ORDER == 0 {
            return;
        }
        for (number, sum) in numbers[1..].iter_mut().zip(&self.gradient) {
            *number = sum.sum_lanes();
        }
        if ORDER == 1 {
            return;
        }
        for (number, sum) in numbers[1 + d..].iter_mut().zip(&self.hessian) {
            *number = sum.sum_lanes();
        }
        numbers[1 + d + self.hessian.len()] = self.trace.sum_lanes();
    }
}
