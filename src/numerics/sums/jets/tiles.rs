//! Sums of gradients and Hessians over a block, a tile of coordinates at a time.
//!
//! A tile of 3 coordinates by 3 keeps its sums in registers for the length of a block, in the 16 registers of AVX2 too.
//! d ≤ 3 is one tile; a larger d is cut into groups of 3 coordinates and a rest, so that no flop is spent on padding.

use pulp::Simd;

use crate::numerics::machine::registers::{Block, Pack};

/// Coordinates per tile.
const TILE: usize = 3;

/// One register of sums.
pub(super) type Sum<S> = Pack<S, 1>;

/// What the sums of a block need: `λφ′`, `λφ″` and the differences D.
pub(super) struct WeightedBlock {
    pub(super) first: Block,
    pub(super) second: Block,
    pub(super) differences: Vec<Block>,
}

impl WeightedBlock {
    pub(super) fn zero(dimension: usize) -> Self {
        Self { first: Block::ZERO, second: Block::ZERO, differences: vec![Block::ZERO; dimension] }
    }

    /// Adds `Σ λφ′ D_a` to `gradient[a]` and, at order 2, `Σ λφ″ D_a D_b` to the upper triangle `hessian`, packed row by
    /// row.
    #[inline(always)]
    pub(super) fn add_to<S: Simd, const ORDER: usize>(
        &self,
        simd: S,
        gradient: &mut [Sum<S>],
        hessian: &mut [Sum<S>],
    ) {
        let mut hessian = Triangle { packed: hessian, dimension: self.differences.len() };
        for a in (0..self.differences.len()).step_by(TILE) {
            match self.differences.len() - a {
                1 => self.add_diagonal_tile::<S, ORDER, 1>(simd, a, gradient, &mut hessian),
                2 => self.add_diagonal_tile::<S, ORDER, 2>(simd, a, gradient, &mut hessian),
                _ => self.add_diagonal_tile::<S, ORDER, TILE>(simd, a, gradient, &mut hessian),
            }
            if ORDER < 2 {
                continue;
            }
            for b in (a + TILE..self.differences.len()).step_by(TILE) {
                match self.differences.len() - b {
                    1 => self.add_tile::<S, 1>(simd, a, b, &mut hessian),
                    2 => self.add_tile::<S, 2>(simd, a, b, &mut hessian),
                    _ => self.add_tile::<S, TILE>(simd, a, b, &mut hessian),
                }
            }
        }
    }

    /// The gradient's entries `a..a + N` and the Hessian's between them.
    #[expect(
        clippy::needless_range_loop,
        reason = "a slice of the sums would keep them in memory, half as fast"
    )]
    #[inline(always)]
    fn add_diagonal_tile<S: Simd, const ORDER: usize, const N: usize>(
        &self,
        simd: S,
        a: usize,
        gradient: &mut [Sum<S>],
        hessian: &mut Triangle<Sum<S>>,
    ) {
        let zero = Sum::splat(simd, 0.0);
        let (mut slopes, mut products) = ([zero; N], [[zero; N]; N]);
        let differences = &self.differences[a..a + N];
        for at in 0..Sum::<S>::PER_BLOCK {
            let (first, second) = (Sum::load(simd, &self.first, at), Sum::load(simd, &self.second, at));
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

    /// The Hessian's rows `a..a + 3`, columns `b..b + N`.
    #[expect(
        clippy::needless_range_loop,
        reason = "a slice of the sums would keep them in memory, half as fast"
    )]
    #[inline(always)]
    fn add_tile<S: Simd, const N: usize>(&self, simd: S, a: usize, b: usize, hessian: &mut Triangle<Sum<S>>) {
        let mut products = [[Sum::splat(simd, 0.0); N]; TILE];
        let (rows, columns) = (&self.differences[a..a + TILE], &self.differences[b..b + N]);
        for at in 0..Sum::<S>::PER_BLOCK {
            let second = Sum::load(simd, &self.second, at);
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
