//! Covariances of the heights and their derivatives, trend and data, written into the matrix to be
//! factorized.

use pulp::Simd;

use super::FactoredBatch;
use crate::machine::lanes::triangle;
use crate::machine::registers::{BLOCK, IN_FLIGHT, Pack};

/// Variance added to every point besides its noise, relative to k₀. It covers rounding of the heights.
const NUGGET: f64 = 1e-13;

impl<S: Simd> FactoredBatch<'_, S> {
    /// Writes φ below the diagonal and 1 + noise onto it. Rows and columns of empty places are those of the
    /// identity.
    #[inline(always)]
    pub(super) fn fill_triangle(&mut self) {
        let n = self.n;
        for i in 0..n {
            let row = triangle(i);
            for j in 0..i {
                let mut q = self.lower.splat(0.0);
                for axis in 0..self.k {
                    let step = self.coordinate(axis, i) - self.coordinate(axis, j);
                    q = step.mul_add(step, q);
                }
                self.lower.set(row + j, q);
            }
            self.lower.set(row + i, self.lower.splat(0.0));
        }
        let entries = &mut self.lower.registers[..triangle(n).next_multiple_of(IN_FLIGHT)];
        self.model.scaling().covariances(self.lower.simd, self.model.family, [entries]);
        for i in 0..n {
            let (row, mask) = (triangle(i), self.mask(i));
            for j in 0..i {
                let both = mask * self.mask(j);
                self.lower.set(row + j, self.lower.at(row + j) * both);
            }
            let noise = self.of(&self.batch.weights, i) * self.model.noise * mask + (1.0 + NUGGET);
            self.lower.set(row + i, noise);
        }
    }

    /// Writes the rows of the trend, of the heights and of the entailed heights. The other extra rows become
    /// 0.
    #[inline(always)]
    pub(super) fn fill_trend(&mut self) {
        let (n, k) = (self.n, self.k);
        let zero = self.lower.splat(0.0);
        for j in 0..n {
            let mask = self.mask(j);
            self.lower.put(n, j, mask);
            for axis in 0..k {
                self.lower.put(n + 1 + axis, j, self.coordinate(axis, j) * mask);
            }
            for term in k + 1..self.p {
                let product = self.of(&self.batch.products, (term - k - 1) * n + j);
                self.lower.put(n + term, j, product * mask);
            }
            if self.p_trend > self.p {
                self.fill_beyond_quadric(j);
            }
            let data = n + self.p_trend;
            self.lower.put(data, j, self.coordinate(k, j) * mask);
            self.lower.put(data + 1, j, self.of(&self.batch.entailed, j) * mask);
            for row in data + 2..n + self.n_extra {
                self.lower.put(row, j, zero);
            }
        }
    }

    /// Writes the monomials of third and fourth order of one place: `t_a t_b t_c`, and after each of them
    /// `t_a t_b t_c t_e` for e ≥ c.
    #[inline(always)]
    fn fill_beyond_quadric(&mut self, j: usize) {
        let k = self.k;
        let mut row = self.n + self.p;
        for a in 0..k {
            let first = self.coordinate(a, j) * self.mask(j);
            for b in a..k {
                let second = first * self.coordinate(b, j);
                for c in b..k {
                    let third = second * self.coordinate(c, j);
                    self.lower.put(row, j, third);
                    row += 1;
                    for e in c..k {
                        self.lower.put(row, j, third * self.coordinate(e, j));
                        row += 1;
                    }
                }
            }
        }
    }

    /// Writes the covariances of the derivatives at the query, t = 0, with g at the points.
    ///
    /// For D = 0 − t_j they are `∂_a k = 2φ′D_a/ℓ²` and `∂_ab k = 4φ″D_aD_b/ℓ⁴ + 2φ′δ_ab/ℓ²`.
    #[inline(always)]
    pub(super) fn fill_covariances(&mut self) {
        let (n, k) = (self.n, self.k);
        let scale = self.model.length_scale.powi(-2);
        let per_block = BLOCK / S::F64_LANES;
        let zero = self.lower.simd.splat_f64s(0.0);
        // A block has at most this many registers.
        let mut q = [zero; BLOCK];
        let mut first = [zero; BLOCK];
        let mut second = [zero; BLOCK];
        let base = n + self.p_trend + 2;
        let mut start = 0;
        while start < n {
            let end = (start + per_block).min(n);
            for j in start..end {
                let mut square = self.lower.splat(0.0);
                for axis in 0..k {
                    let t = self.coordinate(axis, j);
                    square = t.mul_add(t, square);
                }
                square.write(&mut q, j - start);
            }
            let lists = [&mut q, &mut first, &mut second].map(|list| &mut list[..per_block]);
            self.model.scaling().covariances(self.lower.simd, self.model.family, lists);
            for j in start..end {
                let mask = self.mask(j);
                let phi = Pack::<S, 1>::read(self.lower.simd, &q, j - start);
                let slope = Pack::<S, 1>::read(self.lower.simd, &first, j - start) * (2.0 * scale) * mask;
                let bend =
                    Pack::<S, 1>::read(self.lower.simd, &second, j - start) * (4.0 * scale * scale) * mask;
                self.lower.put(base, j, phi * mask);
                let mut term = base + 1 + k;
                for a in 0..k {
                    let t_a = self.coordinate(a, j);
                    self.lower.put(base + 1 + a, j, -(slope * t_a));
                    for b in a..k {
                        let product = bend * t_a * self.coordinate(b, j);
                        let entry = if a == b { product + slope } else { product };
                        self.lower.put(term, j, entry);
                        term += 1;
                    }
                }
            }
            start = end;
        }
    }
}
