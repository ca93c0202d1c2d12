//! Sums of gradients and Hessians over a block, a tile of coordinates at a time.
//!
//! A tile of 3 coordinates by 3 keeps its sums in registers for the length of a block, in the 16 registers of AVX2 too.
//! d ≤ 3 is one tile; a larger d is cut into groups of 3 coordinates and a rest, so that no flop is spent on padding.

use pulp::Simd;

use super::simd::{Block, Pack};

/// Coordinates per tile.
const TILE: usize = 3;

/// One register of sums.
pub(crate) type Sum<S> = Pack<S, 1>;

/// Adds `Σ λφ′ D_a` to `gradient[a]`, given `first = λφ′` and the differences D of a block.
#[inline(always)]
pub(crate) fn add_gradient<S: Simd>(simd: S, first: &Block, differences: &[Block], gradient: &mut [Sum<S>]) {
    for (rows, gradient) in differences.chunks(TILE).zip(gradient.chunks_mut(TILE)) {
        match rows.len() {
            1 => add_slopes::<S, 1>(simd, first, rows, gradient),
            2 => add_slopes::<S, 2>(simd, first, rows, gradient),
            _ => add_slopes::<S, TILE>(simd, first, rows, gradient),
        }
    }
}

/// Adds `Σ λφ″ D_a D_b` to the upper triangle `hessian`, packed row by row, given `second = λφ″`.
#[inline(always)]
pub(crate) fn add_hessian<S: Simd>(simd: S, second: &Block, differences: &[Block], hessian: &mut [Sum<S>]) {
    let mut hessian = Triangle { packed: hessian, dimension: differences.len() };
    for (i, rows) in differences.chunks(TILE).enumerate() {
        let a = i * TILE;
        match rows.len() {
            1 => add_tile::<S, 1, 1, true>(simd, second, rows, rows, &mut hessian, (a, a)),
            2 => add_tile::<S, 2, 2, true>(simd, second, rows, rows, &mut hessian, (a, a)),
            _ => add_tile::<S, TILE, TILE, true>(simd, second, rows, rows, &mut hessian, (a, a)),
        }
        for (j, columns) in differences.chunks(TILE).enumerate().skip(i + 1) {
            let at = (a, j * TILE);
            match columns.len() {
                1 => add_tile::<S, TILE, 1, false>(simd, second, rows, columns, &mut hessian, at),
                2 => add_tile::<S, TILE, 2, false>(simd, second, rows, columns, &mut hessian, at),
                _ => add_tile::<S, TILE, TILE, false>(simd, second, rows, columns, &mut hessian, at),
            }
        }
    }
}

/// The upper triangle of a symmetric matrix, row by row.
struct Triangle<'a, T> {
    packed: &'a mut [T],
    dimension: usize,
}

impl<T> Triangle<'_, T> {
    #[inline(always)]
    fn at(&mut self, a: usize, b: usize) -> &mut T {
        &mut self.packed[a * self.dimension - a * (a + 1) / 2 + b]
    }
}

#[inline(always)]
fn add_slopes<S: Simd, const N: usize>(
    simd: S,
    first: &Block,
    differences: &[Block],
    gradient: &mut [Sum<S>],
) {
    let mut sums = [Sum::splat(simd, 0.0); N];
    for at in 0..Sum::<S>::PER_BLOCK {
        let first = Sum::load(simd, first, at);
        for a in 0..N {
            sums[a] = first.mul_add(Pack::load(simd, &differences[a], at), sums[a]);
        }
    }
    for a in 0..N {
        gradient[a] = gradient[a] + sums[a];
    }
}

/// Adds the sums of rows × columns; of a tile on the diagonal only the entries with a ≤ b.
#[inline(always)]
fn add_tile<S: Simd, const ROWS: usize, const COLUMNS: usize, const DIAGONAL: bool>(
    simd: S,
    second: &Block,
    rows: &[Block],
    columns: &[Block],
    hessian: &mut Triangle<Sum<S>>,
    (row, column): (usize, usize),
) {
    let mut sums = [[Sum::splat(simd, 0.0); COLUMNS]; ROWS];
    for at in 0..Sum::<S>::PER_BLOCK {
        let second = Sum::load(simd, second, at);
        for a in 0..ROWS {
            let weighted = second * Pack::load(simd, &rows[a], at);
            for b in if DIAGONAL { a } else { 0 }..COLUMNS {
                sums[a][b] = weighted.mul_add(Pack::load(simd, &columns[b], at), sums[a][b]);
            }
        }
    }
    for a in 0..ROWS {
        for b in if DIAGONAL { a } else { 0 }..COLUMNS {
            let sum = hessian.at(row + a, column + b);
            *sum = *sum + sums[a][b];
        }
    }
}
