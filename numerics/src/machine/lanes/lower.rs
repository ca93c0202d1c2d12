//! Lower triangles with rows below, one register an entry.

use pulp::Simd;

use super::triangle;
use crate::machine::registers::{BLOCK, Pack};

/// Places of the rows of a system in a list of registers.
#[derive(Clone, Copy)]
pub(crate) struct Layout {
    /// Rows of the triangle, and entries of each row below.
    pub n: usize,
    /// Place of the first row below.
    below: usize,
    /// Distance from one row below to the next.
    stride: usize,
}

impl Layout {
    /// The layout without gaps.
    pub(crate) const fn dense(n: usize) -> Self {
        Self { n, below: triangle(n), stride: n }
    }

    /// The layout whose rows below start at multiples of [`BLOCK`], so that loops over blocks can fill them.
    pub(crate) const fn in_blocks(n: usize) -> Self {
        Self { n, below: triangle(n).next_multiple_of(BLOCK), stride: n.next_multiple_of(BLOCK) }
    }

    /// The place of row i. Rows from n on are those below the triangle.
    #[inline(always)]
    pub(crate) const fn row(&self, i: usize) -> usize {
        if i < self.n { triangle(i) } else { self.below + (i - self.n) * self.stride }
    }
}

/// Lower triangles of several systems with rows below, one system in each lane.
pub(crate) struct Lower<'a, S: Simd> {
    pub simd: S,
    pub layout: Layout,
    pub registers: &'a mut [S::f64s],
}

impl<S: Simd> Lower<'_, S> {
    #[inline(always)]
    pub(crate) fn row(&self, i: usize) -> usize {
        self.layout.row(i)
    }

    #[inline(always)]
    pub(crate) fn splat(&self, x: f64) -> Pack<S, 1> {
        Pack::splat(self.simd, x)
    }

    #[inline(always)]
    pub(crate) fn at(&self, place: usize) -> Pack<S, 1> {
        Pack::read(self.simd, self.registers, place)
    }

    #[inline(always)]
    pub(crate) fn set(&mut self, place: usize, entry: Pack<S, 1>) {
        entry.write(self.registers, place);
    }

    /// Writes entry j of row i.
    #[inline(always)]
    pub(crate) fn put(&mut self, i: usize, j: usize, entry: Pack<S, 1>) {
        self.set(self.row(i) + j, entry);
    }

    /// Returns the inner product of the rows below the triangle that start at places a and b.
    #[inline(always)]
    pub(crate) fn product(&self, a: usize, b: usize) -> Pack<S, 1> {
        let n = self.layout.n;
        let mut sums = [self.splat(0.0); 4];
        let mut l = 0;
        while l + 4 <= n {
            for (s, sum) in sums.iter_mut().enumerate() {
                *sum = self.at(a + l + s).mul_add(self.at(b + l + s), *sum);
            }
            l += 4;
        }
        while l < n {
            sums[0] = self.at(a + l).mul_add(self.at(b + l), sums[0]);
            l += 1;
        }
        (sums[0] + sums[1]) + (sums[2] + sums[3])
    }

    /// Writes L⁻ᵀ times the row at place `from` into the row at place `to`, row by row of L.
    #[inline(always)]
    pub(crate) fn back_substitute(&mut self, from: usize, to: usize) {
        for i in 0..self.layout.n {
            self.set(to + i, self.at(from + i));
        }
        for i in (0..self.layout.n).rev() {
            let row = triangle(i);
            let weight = self.at(to + i) * self.at(row + i);
            self.set(to + i, weight);
            for j in 0..i {
                self.set(to + j, self.at(to + j) - self.at(row + j) * weight);
            }
        }
    }
}
