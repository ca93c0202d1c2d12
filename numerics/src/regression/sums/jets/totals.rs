//! An expansion in blocks, and the sums of a pass over it.

use pulp::Simd;

use crate::kernel::Kernel;
use crate::machine::registers::{Block, Pack};
use crate::regression::sums::nodes::{BlockPairs, Nodes};

/// The function `Σ_j λ_j k(·, x_j)`, with points and weights laid out in blocks.
#[derive(Clone, Copy)]
pub(super) struct Expansion<'a> {
    pub(super) nodes: &'a Nodes,
    pub(super) kernel: &'a Kernel,
    pub(super) weights: &'a [Block],
}

/// A sum in one register.
pub(super) type Sum<S> = Pack<S, 1>;

/// The profiles of one query with a block of points, and the differences D.
pub(super) struct ProfileBlock {
    /// φ, φ′, φ″.
    pub(super) profiles: [Block; 3],
    pub(super) differences: Vec<Block>,
}

impl ProfileBlock {
    pub(super) fn zero(dimension: usize) -> Self {
        Self { profiles: [Block::ZERO; 3], differences: vec![Block::ZERO; dimension] }
    }

    /// Computes the differences and profiles of a query with a block of points.
    #[inline(always)]
    pub(super) fn fill<S: Simd, const ORDER: usize>(
        &mut self,
        simd: S,
        nodes: &Nodes,
        pairs: BlockPairs<'_>,
    ) {
        let Self { profiles: [phi, slope, bend], differences } = self;
        nodes.squared_distances(simd, pairs, phi, differences);
        let (phi, kernel) = (phi.registers_mut::<S>(), pairs.kernel);
        match ORDER {
            1 => kernel.profiles(simd, [phi, slope.registers_mut::<S>()]),
            _ => kernel.profiles(simd, [phi, slope.registers_mut::<S>(), bend.registers_mut::<S>()]),
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

    /// Writes the sums up to an order, in the sequence that [`finish`](super::Layout::finish) takes.
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
