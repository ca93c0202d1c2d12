//! Sums of gradients and Hessians over a block, a tile of coordinates at a time.
//!
//! A tile of 3 by 3 coordinates keeps its sums in registers for the length of a block, even in the 16
//! registers of AVX2. d ≤ 3 is one tile. A larger d is cut into groups of 3 coordinates and a rest, so that
//! no flop is spent on padding.

use pulp::Simd;

use super::totals::{Expansion, ProfileBlock, Sum, Sums};
use crate::kernel::{HUGE, Kernel, Terms, distance_and_inverse};
use crate::machine::registers::{Block, Pack};
use crate::regression::sums::nodes::{BlockPairs, Nodes};

/// Coordinates per tile.
const TILE: usize = 3;

/// `Σλφ` of a query and the points of a block, added to `value`.
struct Values<'a, S: Simd> {
    simd: S,
    nodes: &'a Nodes,
    pairs: BlockPairs<'a>,
    weights: &'a Block,
    value: Sum<S>,
}

impl<S: Simd> Terms<S> for Values<'_, S> {
    #[inline(always)]
    fn n_packs(&self) -> usize {
        Pack::<S>::PER_BLOCK
    }

    #[inline(always)]
    fn squared_distances(&self, at: usize) -> Pack<S> {
        self.nodes.squared_distances_of_pack(self.simd, self.pairs, at, |_, _| {})
    }

    #[inline(always)]
    fn add(&mut self, at: usize, phi: Pack<S>) {
        self.value = Pack::load(self.simd, self.weights, at).add_products_to(phi, self.value);
    }
}

impl<S: Simd> Sums<S> {
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
        if ORDER == 0 {
            let (pairs, weights) = (BlockPairs { kernel, x, block }, &weights[block]);
            let mut values = Values { simd, nodes, pairs, weights, value: self.value };
            kernel.fold(&mut values);
            self.value = values.value;
            return;
        }
        self.block.fill::<S, ORDER>(simd, nodes, BlockPairs { kernel, x, block });
        self.add_block::<ORDER>(simd, &weights[block]);
    }

    /// Adds the contributions of a block, whose differences and profiles are at hand.
    #[inline(always)]
    pub(super) fn add_block<const ORDER: usize>(&mut self, simd: S, weights: &Block) {
        let d = self.gradient.len();
        for a in (0..d).step_by(TILE) {
            match d - a {
                1 => self.add_diagonal_tile::<ORDER, 1>(simd, weights, a),
                2 => self.add_diagonal_tile::<ORDER, 2>(simd, weights, a),
                _ => self.add_diagonal_tile::<ORDER, TILE>(simd, weights, a),
            }
            if ORDER < 2 {
                continue;
            }
            for b in (a + TILE..d).step_by(TILE) {
                match d - b {
                    1 => self.add_tile::<1>(simd, weights, a, b),
                    2 => self.add_tile::<2>(simd, weights, a, b),
                    _ => self.add_tile::<TILE>(simd, weights, a, b),
                }
            }
        }
    }

    /// Adds to the entries `a..a + N` of the gradient, and to those of the Hessian between these coordinates.
    /// With the first coordinates it also adds the sums that need no difference.
    #[expect(
        clippy::needless_range_loop,
        reason = "a slice of the sums would keep them in memory, half as fast"
    )]
    #[inline(always)]
    fn add_diagonal_tile<const ORDER: usize, const N: usize>(&mut self, simd: S, weights: &Block, a: usize) {
        let zero = Sum::splat(simd, 0.0);
        let (mut value, mut trace, mut slopes, mut products) = (zero, zero, [zero; N], [[zero; N]; N]);
        let ProfileBlock { profiles, differences } = &self.block;
        let differences = &differences[a..a + N];
        for at in 0..Sum::<S>::PER_BLOCK {
            let weight = Sum::load(simd, weights, at);
            let first = weight * Sum::load(simd, &profiles[1], at);
            let second = weight * Sum::load(simd, &profiles[2], at);
            value = weight.mul_add(Sum::load(simd, &profiles[0], at), value);
            trace = trace + first;
            for i in 0..N {
                let difference = Sum::load(simd, &differences[i], at);
                slopes[i] = first.mul_add(difference, slopes[i]);
                if ORDER >= 2 {
                    let weighted = second * difference;
                    for j in i..N {
                        let other = Sum::load(simd, &differences[j], at);
                        products[i][j] = weighted.mul_add(other, products[i][j]);
                    }
                }
            }
        }
        if a == 0 {
            (self.value, self.trace) = (self.value + value, self.trace + trace);
        }
        for i in 0..N {
            self.gradient[a + i] = self.gradient[a + i] + slopes[i];
            if ORDER >= 2 {
                for j in i..N {
                    self.add_to_hessian(a + i, a + j, products[i][j]);
                }
            }
        }
    }

    /// Adds to rows `a..a + 3`, columns `b..b + N` of the Hessian.
    #[expect(
        clippy::needless_range_loop,
        reason = "a slice of the sums would keep them in memory, half as fast"
    )]
    #[inline(always)]
    fn add_tile<const N: usize>(&mut self, simd: S, weights: &Block, a: usize, b: usize) {
        let mut products = [[Sum::splat(simd, 0.0); N]; TILE];
        let ProfileBlock { profiles, differences } = &self.block;
        let (rows, columns) = (&differences[a..a + TILE], &differences[b..b + N]);
        for at in 0..Sum::<S>::PER_BLOCK {
            let second = Sum::load(simd, weights, at) * Sum::load(simd, &profiles[2], at);
            for i in 0..TILE {
                let weighted = second * Sum::load(simd, &rows[i], at);
                for j in 0..N {
                    products[i][j] = weighted.mul_add(Sum::load(simd, &columns[j], at), products[i][j]);
                }
            }
        }
        for i in 0..TILE {
            for j in 0..N {
                self.add_to_hessian(a + i, b + j, products[i][j]);
            }
        }
    }

    #[inline(always)]
    fn add_to_hessian(&mut self, a: usize, b: usize, sum: Sum<S>) {
        let entry = &mut self.hessian[a * self.gradient.len() - a * (a + 1) / 2 + b];
        *entry = *entry + sum;
    }

    /// Adds `Σ|λ|φ` and `Σ|λφ′|√q` to the magnitudes.
    #[inline(always)]
    pub(super) fn add_magnitudes(&mut self, simd: S, weights: &Block, kernel: &Kernel) {
        let ProfileBlock { profiles, differences } = &self.block;
        for at in 0..Sum::<S>::PER_BLOCK {
            let weight = Sum::load(simd, weights, at).abs();
            let phi = Sum::load(simd, &profiles[0], at);
            let slope = Sum::load(simd, &profiles[1], at);
            let mut square = Sum::splat(simd, 0.0);
            for differences in differences {
                let difference = Sum::load(simd, differences, at);
                square = difference.mul_add(difference, square);
            }
            self.magnitudes[0] = weight.mul_add(phi, self.magnitudes[0]);
            let (distance, _) = distance_and_inverse(square * kernel.inverse_square_length(), HUGE);
            self.magnitudes[1] = (-(weight * slope)).mul_add(distance, self.magnitudes[1]);
        }
    }
}

/// Adds the contributions of two points x to the sums of every point y of a block, in dimension N.
///
/// With D = y − x they are `λφ`, `λφ′D`, `λφ″DD` and `λφ′`. `sums` has a block for each entry. The two points
/// share loads and stores.
#[expect(clippy::needless_range_loop, reason = "the methods of arrays are not compiled into the loop")]
#[inline(always)]
pub(super) fn mirror<S: Simd, const N: usize>(simd: S, given: [(&ProfileBlock, f64); 2], sums: &mut [Block]) {
    let zero = Sum::splat(simd, 0.0);
    for at in 0..Sum::<S>::PER_BLOCK {
        let (mut weight, mut phi, mut slope) = ([zero; 2], [zero; 2], [zero; 2]);
        let (mut first, mut second, mut differences) = ([zero; 2], [zero; 2], [[zero; 2]; N]);
        for k in 0..2 {
            let (block, lambda) = given[k];
            weight[k] = Sum::splat(simd, lambda);
            phi[k] = Sum::load(simd, &block.profiles[0], at);
            slope[k] = Sum::load(simd, &block.profiles[1], at);
            first[k] = -(weight[k] * slope[k]);
            second[k] = weight[k] * Sum::load(simd, &block.profiles[2], at);
            for axis in 0..N {
                differences[axis][k] = Sum::load(simd, &block.differences[axis], at);
            }
        }
        add_products(simd, at, weight, phi, &mut sums[0]);
        let mut entry = N + 1;
        for a in 0..N {
            add_products(simd, at, first, differences[a], &mut sums[1 + a]);
            let mut weighted = [zero; 2];
            for k in 0..2 {
                weighted[k] = second[k] * differences[a][k];
            }
            for b in a..N {
                add_products(simd, at, weighted, differences[b], &mut sums[entry]);
                entry += 1;
            }
        }
        add_products(simd, at, weight, slope, &mut sums[entry]);
    }
}

#[inline(always)]
fn add_products<S: Simd>(simd: S, at: usize, a: [Sum<S>; 2], b: [Sum<S>; 2], block: &mut Block) {
    let mut sum = Sum::load(simd, block, at);
    for k in 0..2 {
        sum = a[k].mul_add(b[k], sum);
    }
    sum.store(block, at);
}
