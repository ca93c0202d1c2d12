//! Cholesky factorization K = LLᵀ in tiles of registers.

use pulp::Simd;

use super::{Factored, ROWS};
use crate::machine::registers::Pack;

/// Columns of a tile. With [`ROWS`] rows that makes 8 chains of products that do not wait for one another.
const COLUMNS: usize = 2;

impl<S: Simd> Factored<'_, S> {
    /// Factorizes K = LLᵀ, left-looking, in tiles. The rows of the right-hand sides below K become their
    /// products with L⁻ᵀ.
    #[inline(always)]
    pub(super) fn factorize(&mut self, n_rows: usize) {
        let mut column = 0;
        while column < self.n {
            // The triangle on the diagonal, row by row.
            for i in column..(column + COLUMNS).min(n_rows) {
                self.tile::<1>(i, column);
            }
            let mut i = column + COLUMNS;
            while i < n_rows {
                if i + ROWS <= n_rows {
                    self.tile::<ROWS>(i, column);
                    i += ROWS;
                } else {
                    self.tile::<1>(i, column);
                    i += 1;
                }
            }
            column += COLUMNS;
        }
    }

    /// Computes R rows from i on in the [`COLUMNS`] columns from `column` on. All columns before must be
    /// done.
    #[inline(always)]
    fn tile<const R: usize>(&mut self, i: usize, column: usize) {
        let zero = Pack::<S, 1>::splat(self.simd, 0.0);
        let mut rows = [0; R];
        for (r, row) in rows.iter_mut().enumerate() {
            *row = self.row(i + r);
        }
        let columns = [self.row(column), self.row(column + 1)];
        let mut sums = [[zero; COLUMNS]; R];
        {
            let matrix = &*self.matrix;
            let left = [&matrix[columns[0]..][..column], &matrix[columns[1]..][..column]];
            let mut slices = [left[0]; R];
            for r in 0..R {
                slices[r] = &matrix[rows[r]..][..column];
            }
            for l in 0..column {
                let a = Pack::<S, 1>::read(self.simd, left[0], l);
                let b = Pack::<S, 1>::read(self.simd, left[1], l);
                for r in 0..R {
                    let x = Pack::<S, 1>::read(self.simd, slices[r], l);
                    sums[r][0] = x.mul_add(a, sums[r][0]);
                    sums[r][1] = x.mul_add(b, sums[r][1]);
                }
            }
        }
        for r in 0..R {
            let row = rows[r];
            let first = self.at(row + column) - sums[r][0];
            if i + r == column {
                // The inverse of the diagonal is kept in its place, because the rows below multiply by it.
                (1.0 / first.sqrt()).write(self.matrix, row + column);
                continue;
            }
            let first = first * self.at(columns[0] + column);
            first.write(self.matrix, row + column);
            let cross = self.at(columns[1] + column);
            let second = if i + r == column + 1 {
                self.at(row + column + 1) - first.mul_add(first, sums[r][1])
            } else {
                self.at(row + column + 1) - first.mul_add(cross, sums[r][1])
            };
            if i + r == column + 1 {
                (1.0 / second.sqrt()).write(self.matrix, row + column + 1);
            } else {
                (second * self.at(columns[1] + column + 1)).write(self.matrix, row + column + 1);
            }
        }
    }

    /// Inner product of rows i and j over the n points.
    #[inline(always)]
    pub(super) fn product(&self, i: usize, j: usize) -> Pack<S, 1> {
        let (a, b) = (self.row(i), self.row(j));
        let mut sums = [Pack::<S, 1>::splat(self.simd, 0.0); 4];
        let mut l = 0;
        while l + 4 <= self.n {
            for (s, sum) in sums.iter_mut().enumerate() {
                *sum = self.at(a + l + s).mul_add(self.at(b + l + s), *sum);
            }
            l += 4;
        }
        while l < self.n {
            sums[0] = self.at(a + l).mul_add(self.at(b + l), sums[0]);
            l += 1;
        }
        (sums[0] + sums[1]) + (sums[2] + sums[3])
    }
}
