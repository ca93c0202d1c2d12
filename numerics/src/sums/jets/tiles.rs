//! Sums of gradients and Hessians over a block, a tile of coordinates at a time.
//!
//! A tile of 3 by 3 coordinates keeps its sums in registers for the length of a block, even in the 16
//! registers of AVX2. d ≤ 3 is one tile. A larger d is cut into groups of 3 coordinates and a rest, so that
//! no flop is spent on padding.

use pulp::Simd;

use crate::kernel::{HUGE, Kernel, distance_and_inverse};
use crate::machine::registers::{Block, Pack};

/// Coordinates per tile.
const TILE: usize = 3;

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

    /// Adds `Σ λφ′ D_a` to `gradient[a]`. At order 2, also adds `Σ λφ″ D_a D_b` to the upper triangle
    /// `hessian`, packed row by row.
    #[inline(always)]
    pub(super) fn add_to<S: Simd, const ORDER: usize>(
        &self,
        simd: S,
        weights: &Block,
        gradient: &mut [Sum<S>],
        hessian: &mut [Sum<S>],
    ) {
        let mut hessian = Triangle { packed: hessian, dimension: self.differences.len() };
        for a in (0..self.differences.len()).step_by(TILE) {
            match self.differences.len() - a {
                1 => self.add_diagonal_tile::<S, ORDER, 1>(simd, weights, a, gradient, &mut hessian),
                2 => self.add_diagonal_tile::<S, ORDER, 2>(simd, weights, a, gradient, &mut hessian),
                _ => self.add_diagonal_tile::<S, ORDER, TILE>(simd, weights, a, gradient, &mut hessian),
            }
            if ORDER < 2 {
                continue;
            }
            for b in (a + TILE..self.differences.len()).step_by(TILE) {
                match self.differences.len() - b {
                    1 => self.add_tile::<S, 1>(simd, weights, a, b, &mut hessian),
                    2 => self.add_tile::<S, 2>(simd, weights, a, b, &mut hessian),
                    _ => self.add_tile::<S, TILE>(simd, weights, a, b, &mut hessian),
                }
            }
        }
    }

    /// Adds to the entries `a..a + N` of the gradient, and to those of the Hessian between these coordinates.
    #[expect(
        clippy::needless_range_loop,
        reason = "a slice of the sums would keep them in memory, half as fast"
    )]
    #[inline(always)]
    fn add_diagonal_tile<S: Simd, const ORDER: usize, const N: usize>(
        &self,
        simd: S,
        weights: &Block,
        a: usize,
        gradient: &mut [Sum<S>],
        hessian: &mut Triangle<Sum<S>>,
    ) {
        let zero = Sum::splat(simd, 0.0);
        let (mut slopes, mut products) = ([zero; N], [[zero; N]; N]);
        let differences = &self.differences[a..a + N];
        for at in 0..Sum::<S>::PER_BLOCK {
            let weight = Sum::load(simd, weights, at);
            let first = weight * Sum::load(simd, &self.profiles[1], at);
            let second = weight * Sum::load(simd, &self.profiles[2], at);
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
        for i in 0..N {
            gradient[a + i] = gradient[a + i] + slopes[i];
            if ORDER >= 2 {
                for j in i..N {
                    hessian.add(a + i, a + j, products[i][j]);
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
    fn add_tile<S: Simd, const N: usize>(
        &self,
        simd: S,
        weights: &Block,
        a: usize,
        b: usize,
        hessian: &mut Triangle<Sum<S>>,
    ) {
        let mut products = [[Sum::splat(simd, 0.0); N]; TILE];
        let (rows, columns) = (&self.differences[a..a + TILE], &self.differences[b..b + N]);
        for at in 0..Sum::<S>::PER_BLOCK {
            let second = Sum::load(simd, weights, at) * Sum::load(simd, &self.profiles[2], at);
            for i in 0..TILE {
                let weighted = second * Sum::load(simd, &rows[i], at);
                for j in 0..N {
                    products[i][j] = weighted.mul_add(Sum::load(simd, &columns[j], at), products[i][j]);
                }
            }
        }
        for i in 0..TILE {
            for j in 0..N {
                hessian.add(a + i, b + j, products[i][j]);
            }
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

impl ProfileBlock {
    /// Adds `Σ|λ|φ` and `Σ|λφ′|√q` to `magnitudes`.
    #[inline(always)]
    pub(super) fn add_magnitudes<S: Simd>(
        &self,
        simd: S,
        weights: &Block,
        kernel: &Kernel,
        magnitudes: &mut [Sum<S>; 2],
    ) {
        for at in 0..Sum::<S>::PER_BLOCK {
            let weight = Sum::load(simd, weights, at).abs();
            let phi = Sum::load(simd, &self.profiles[0], at);
            let slope = Sum::load(simd, &self.profiles[1], at);
            let mut square = Sum::splat(simd, 0.0);
            for differences in &self.differences {
                let difference = Sum::load(simd, differences, at);
                square = difference.mul_add(difference, square);
            }
            magnitudes[0] = weight.mul_add(phi, magnitudes[0]);
            let (distance, _) = distance_and_inverse(square * kernel.inverse_square_length(), HUGE);
            magnitudes[1] = (-(weight * slope)).mul_add(distance, magnitudes[1]);
        }
    }
}

/// The upper triangle of a symmetric matrix, row by row.
struct Triangle<'a, T> {
    packed: &'a mut [T],
    dimension: usize,
}

impl<S: Simd> Triangle<'_, Sum<S>> {
    #[inline(always)]
    fn add(&mut self, a: usize, b: usize, sum: Sum<S>) {
        let entry = &mut self.packed[a * self.dimension - a * (a + 1) / 2 + b];
        *entry = *entry + sum;
    }
}
