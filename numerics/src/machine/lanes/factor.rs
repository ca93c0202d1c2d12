//! Cholesky factorization K = LLᵀ in tiles of registers.

use std::ops::Range;

use pulp::Simd;

use super::{Lower, MAX_LANES};
use crate::machine::registers::Pack;

/// Columns of large systems that are solved for at once. With as many rows they make 16 independent chains of
/// products.
pub(crate) const COLUMNS: usize = 4;

/// Rules by which the entries of a factor are rounded.
pub(crate) trait Rounding<S: Simd> {
    /// Whether the products within a tile join the sum of those before it. Otherwise each is subtracted by
    /// itself.
    const JOINS_PRODUCTS: bool;

    /// Returns an entry of row i as it is stored.
    fn entry(&self, i: usize, entry: Pack<S, 1>) -> Pack<S, 1>;

    /// Returns the inverse of a diagonal entry of L, from its square.
    fn inverse_root(&self, square: Pack<S, 1>) -> Pack<S, 1>;
}

impl<S: Simd> Lower<'_, S> {
    /// Factorizes large systems, by [`COLUMNS`] and with as many rows at once as there are registers for.
    #[inline(always)]
    pub(crate) fn factorize_wide(&mut self, below: Range<usize>, rounding: &impl Rounding<S>) {
        if S::F64_LANES == MAX_LANES {
            self.factorize::<4, COLUMNS>(below, rounding);
        } else {
            self.factorize::<2, COLUMNS>(below, rounding);
        }
    }

    /// Factorizes K = LLᵀ, left-looking, and multiplies the rows `below` by L⁻ᵀ.
    ///
    /// A tile has `ROWS` rows and `COLUMNS` columns, hence as many chains of products that do not wait for
    /// one another. The number of rows of K must be a multiple of `COLUMNS`. Each diagonal entry of L is
    /// replaced by its inverse, because the rows below multiply by it.
    #[inline(always)]
    pub(crate) fn factorize<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        below: Range<usize>,
        rounding: &impl Rounding<S>,
    ) {
        let n = self.layout.n;
        for column in (0..n).step_by(COLUMNS) {
            // The triangle on the diagonal, row by row.
            self.tiles::<1, COLUMNS>(column..column + COLUMNS, column, rounding);
            self.rows::<ROWS, COLUMNS>(column + COLUMNS..n, column, rounding);
            self.rows::<ROWS, COLUMNS>(below.clone(), column, rounding);
        }
    }

    /// Computes a range of rows in the columns from `column` on, the last few in pairs and alone.
    #[inline(always)]
    fn rows<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        rows: Range<usize>,
        column: usize,
        rounding: &impl Rounding<S>,
    ) {
        let rest = self.tiles::<ROWS, COLUMNS>(rows, column, rounding);
        let rest = self.tiles::<2, COLUMNS>(rest, column, rounding);
        self.tiles::<1, COLUMNS>(rest, column, rounding);
    }

    /// Computes all tiles of `ROWS` rows in a range and returns the rows that are left.
    #[inline(always)]
    fn tiles<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        mut rows: Range<usize>,
        column: usize,
        rounding: &impl Rounding<S>,
    ) -> Range<usize> {
        while rows.len() >= ROWS {
            self.tile::<ROWS, COLUMNS>(rows.start, column, rounding);
            rows.start += ROWS;
        }
        rows
    }

    /// Computes `ROWS` rows from i on in the columns from `column` on. All columns before must be done.
    #[inline(always)]
    fn tile<const ROWS: usize, const COLUMNS: usize>(
        &mut self,
        i: usize,
        column: usize,
        rounding: &impl Rounding<S>,
    ) {
        let mut sums = [[self.splat(0.0); COLUMNS]; ROWS];
        {
            let registers = &*self.registers;
            let mut above = [&registers[..column]; COLUMNS];
            let mut left = [&registers[..column]; ROWS];
            for c in 0..COLUMNS {
                above[c] = &registers[self.row(column + c)..][..column];
            }
            for r in 0..ROWS {
                left[r] = &registers[self.row(i + r)..][..column];
            }
            for l in 0..column {
                let mut factors = [self.splat(0.0); COLUMNS];
                for c in 0..COLUMNS {
                    factors[c] = Pack::read(self.simd, above[c], l);
                }
                for r in 0..ROWS {
                    let entry = Pack::<S, 1>::read(self.simd, left[r], l);
                    for c in 0..COLUMNS {
                        sums[r][c] = entry.mul_add(factors[c], sums[r][c]);
                    }
                }
            }
        }
        for (r, sums) in sums.into_iter().enumerate() {
            self.finish(i + r, column, sums, rounding);
        }
    }

    /// Computes the entries of row i of a tile. `sums` are the products of the columns before.
    #[inline(always)]
    fn finish<const COLUMNS: usize, R: Rounding<S>>(
        &mut self,
        i: usize,
        column: usize,
        sums: [Pack<S, 1>; COLUMNS],
        rounding: &R,
    ) {
        let first = self.row(i) + column;
        let mut entries = sums;
        for c in 0..COLUMNS {
            let above = self.row(column + c) + column;
            let known = entries.iter().enumerate().take(c);
            let mut rest = self.at(first + c);
            if R::JOINS_PRODUCTS {
                let mut sum = sums[c];
                for (b, entry) in known {
                    sum = entry.mul_add(self.at(above + b), sum);
                }
                rest = rest - sum;
            } else {
                rest = rest - sums[c];
                for (b, entry) in known {
                    rest = rest - *entry * self.at(above + b);
                }
            }
            if i == column + c {
                self.set(first + c, rounding.inverse_root(rest));
                return;
            }
            entries[c] = rounding.entry(i, rest * self.at(above + c));
            self.set(first + c, entries[c]);
        }
    }
}
