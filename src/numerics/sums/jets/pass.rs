//! The sums over all points for some consecutive queries, block by block.

use pulp::{Simd, WithSimd};

use super::tiles::{Sum, WeightedBlock};
use super::{JetOrder, Layout};
use crate::numerics::kernel::{Kernel, Pairs};
use crate::numerics::machine::registers::{Block, Pack};
use crate::numerics::points::cloud::Cloud;
use crate::numerics::sums::nodes::Nodes;

/// `Σ_j λ_j k(·, x_j)`.
#[derive(Clone, Copy)]
pub(super) struct Expansion<'a> {
    pub(super) nodes: &'a Nodes,
    pub(super) kernel: &'a Kernel,
    pub(super) weights: &'a [Block],
}

/// The jets of the queries from `first` on.
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
            JetOrder::Value => self.run::<S, 0, false>(simd),
            JetOrder::Gradient => self.run::<S, 1, false>(simd),
            JetOrder::Hessian => self.run::<S, 2, false>(simd),
            JetOrder::HessianWithMagnitudes => self.run::<S, 2, true>(simd),
        }
    }
}

impl Pass<'_> {
    #[inline(always)]
    fn run<S: Simd, const ORDER: usize, const MAGNITUDES: bool>(self, simd: S) {
        let Self { expansion, queries, first, jets, layout } = self;
        let mut sums = Sums::new(simd, layout.dimension);
        for (k, jet) in jets.chunks_exact_mut(layout.width()).enumerate() {
            let x = queries.point(first + k);
            sums.clear(simd);
            for block in 0..expansion.weights.len() {
                let sums = &mut sums;
                let pairs = Weighted::<S, ORDER, MAGNITUDES> { simd, expansion, block, x, sums };
                expansion.kernel.profiles(pairs);
                if ORDER >= 1 {
                    sums.block.add_to::<S, ORDER>(simd, &mut sums.gradient, &mut sums.hessian);
                }
            }
            sums.finish::<ORDER, MAGNITUDES>(expansion.kernel, jet);
        }
    }
}

/// What a pass has summed up for a query, and the block at hand.
struct Sums<S: Simd> {
    /// `Σλφ`.
    value: Sum<S>,
    /// `Σλφ′`, which enters the whole diagonal of the Hessian.
    trace: Sum<S>,
    /// `Σ|λ|φ` and `Σ|λφ′|√q`.
    magnitudes: [Sum<S>; 2],
    /// `Σλφ′D_a`.
    gradient: Vec<Sum<S>>,
    /// `Σλφ″D_aD_b`, a ≤ b, row by row.
    hessian: Vec<Sum<S>>,
    block: WeightedBlock,
}

impl<S: Simd> Sums<S> {
    #[inline(always)]
    fn new(simd: S, d: usize) -> Self {
        let zero = Sum::splat(simd, 0.0);
        Self {
            value: zero,
            trace: zero,
            magnitudes: [zero; 2],
            gradient: vec![zero; d],
            hessian: vec![zero; d * (d + 1) / 2],
            block: WeightedBlock::zero(d),
        }
    }

    #[inline(always)]
    fn clear(&mut self, simd: S) {
        let zero = Sum::splat(simd, 0.0);
        (self.value, self.trace, self.magnitudes) = (zero, zero, [zero; 2]);
        self.gradient.fill(zero);
        self.hessian.fill(zero);
    }

    /// Turns the sums into a jet: factors `variance·{1, 2/ℓ², 4/ℓ⁴}`, and the term `2φ′·I/ℓ²` of the Hessian.
    ///
    /// Multiplying by 1/ℓ one after the other keeps ℓ⁴ out of float64's way.
    #[inline(always)]
    fn finish<const ORDER: usize, const MAGNITUDES: bool>(&self, kernel: &Kernel, jet: &mut [f64]) {
        let (variance, inverse) = (kernel.variance(), 1.0 / kernel.length_scale());
        let mut jet = jet.iter_mut();
        let mut put = |number: f64| {
            if let Some(slot) = jet.next() {
                *slot = number;
            }
        };
        put(variance * self.value.sum_lanes());
        if ORDER == 0 {
            return;
        }
        for sum in &self.gradient {
            put(2.0 * (variance * sum.sum_lanes()) * inverse * inverse);
        }
        if ORDER == 1 {
            return;
        }
        let d = self.gradient.len();
        let trace_term = 2.0 * variance * self.trace.sum_lanes() * inverse * inverse;
        let mut packed = self.hessian.iter();
        for a in 0..d {
            for (b, sum) in (a..d).zip(&mut packed) {
                let entry = 4.0 * (variance * sum.sum_lanes()) * inverse * inverse * inverse * inverse;
                put(if a == b { entry + trace_term } else { entry });
            }
        }
        if MAGNITUDES {
            put(variance * self.magnitudes[0].sum_lanes());
            put(variance * self.magnitudes[1].sum_lanes() * 2.0 * inverse);
        }
    }
}

/// Computes a block's differences and weighted profiles, and adds up what needs no difference.
struct Weighted<'a, S: Simd, const ORDER: usize, const MAGNITUDES: bool> {
    simd: S,
    expansion: Expansion<'a>,
    block: usize,
    x: &'a [f64],
    sums: &'a mut Sums<S>,
}

impl<S: Simd, const ORDER: usize, const MAGNITUDES: bool> Pairs<S> for Weighted<'_, S, ORDER, MAGNITUDES> {
    type Others = Pack<S>;

    #[inline(always)]
    fn pack(&mut self, at: usize) -> (Pack<S>, Pack<S>) {
        let Expansion { nodes, kernel, .. } = self.expansion;
        let differences = &mut self.sums.block.differences;
        let q = nodes.scaled_distances(self.simd, (self.block, at), self.x, kernel, |c, difference| {
            if ORDER >= 1 {
                difference.store(&mut differences[c], at);
            }
        });
        (q, q)
    }

    #[inline(always)]
    fn take(&mut self, at: usize, q: Pack<S>, [phi, slope, bend]: [Pack<S>; 3]) {
        let weight = Pack::load(self.simd, &self.expansion.weights[self.block], at);
        let sums = &mut *self.sums;
        sums.value = sums.value + (weight * phi).sum_registers();
        if ORDER >= 1 {
            (weight * slope).store(&mut sums.block.first, at);
        }
        if ORDER >= 2 {
            sums.trace = sums.trace + (weight * slope).sum_registers();
            (weight * bend).store(&mut sums.block.second, at);
        }
        if MAGNITUDES {
            let weight = weight.abs();
            sums.magnitudes[0] = sums.magnitudes[0] + (weight * phi).sum_registers();
            sums.magnitudes[1] = sums.magnitudes[1] - (weight * slope * q.sqrt()).sum_registers();
        }
    }
}
