//! Covariances of the heights and their derivatives, trend and data, written into the matrix to be
//! factorized.

use pulp::Simd;

use super::{Factored, triangle};
use crate::kernel::Pairs;
use crate::machine::registers::{BLOCK, Pack};

/// Variance added to every point besides its noise, relative to k₀. It covers rounding of the heights.
const NUGGET: f64 = 1e-13;

/// A pass that replaces squared distances by φ, in place.
struct Fill<'a, S: Simd> {
    simd: S,
    entries: &'a mut [S::f64s],
    scale: f64,
}

impl<S: Simd> Pairs<S> for Fill<'_, S> {
    type Others = ();

    #[inline(always)]
    fn pack(&mut self, at: usize) -> (Pack<S>, ()) {
        (Pack::read(self.simd, self.entries, at) * self.scale, ())
    }

    #[inline(always)]
    fn take(&mut self, at: usize, (): (), profile: [Pack<S>; 3]) {
        profile[0].write(self.entries, at);
    }
}

/// A pass that computes φ, φ′ and φ″ for one block of squared distances.
struct Derivatives<'a, S: Simd> {
    simd: S,
    entries: &'a mut [S::f64s],
    first: &'a mut [S::f64s],
    second: &'a mut [S::f64s],
    scale: f64,
}

impl<S: Simd> Pairs<S> for Derivatives<'_, S> {
    type Others = ();

    #[inline(always)]
    fn pack(&mut self, at: usize) -> (Pack<S>, ()) {
        (Pack::read(self.simd, self.entries, at) * self.scale, ())
    }

    #[inline(always)]
    fn take(&mut self, at: usize, (): (), profile: [Pack<S>; 3]) {
        profile[0].write(self.entries, at);
        profile[1].write(self.first, at);
        profile[2].write(self.second, at);
    }
}

impl<S: Simd> Factored<'_, S> {
    /// Writes φ below the diagonal and 1 + noise onto it. Rows and columns of empty places are those of the
    /// identity.
    #[inline(always)]
    pub(super) fn fill_triangle(&mut self) {
        let n = self.n;
        for i in 0..n {
            let row = triangle(i);
            for j in 0..i {
                let mut q = Pack::<S, 1>::splat(self.simd, 0.0);
                for axis in 0..self.k {
                    let step = self.coordinate(axis, i) - self.coordinate(axis, j);
                    q = step.mul_add(step, q);
                }
                q.write(self.matrix, row + j);
            }
            Pack::<S, 1>::splat(self.simd, 0.0).write(self.matrix, row + i);
        }
        let scale = self.model.length_scale.powi(-2);
        let per_block = BLOCK / S::F64_LANES;
        let n_blocks = triangle(n).div_ceil(per_block);
        for block in 0..n_blocks {
            let entries = &mut self.matrix[block * per_block..][..per_block];
            self.model.family.profiles(Fill { simd: self.simd, entries, scale });
        }
        for i in 0..n {
            let (row, mask) = (triangle(i), self.mask(i));
            for j in 0..i {
                let both = mask * self.mask(j);
                (self.at(row + j) * both).write(self.matrix, row + j);
            }
            let noise = self.of(&self.batch.weights, i) * self.model.noise * mask + (1.0 + NUGGET);
            noise.write(self.matrix, row + i);
        }
    }

    /// Writes the rows of the trend, of the heights and of the entailed heights. The other extra rows become
    /// 0.
    #[inline(always)]
    pub(super) fn fill_trend(&mut self) {
        let (n, k) = (self.n, self.k);
        let zero = Pack::<S, 1>::splat(self.simd, 0.0);
        for j in 0..n {
            let mask = self.mask(j);
            mask.write(self.matrix, self.row(n) + j);
            for axis in 0..k {
                (self.coordinate(axis, j) * mask).write(self.matrix, self.row(n + 1 + axis) + j);
            }
            for term in k + 1..self.p {
                let product = self.of(&self.batch.products, (term - k - 1) * n + j);
                let product = if term < self.p_trend { product * mask } else { zero };
                product.write(self.matrix, self.row(n + term) + j);
            }
            (self.coordinate(k, j) * mask).write(self.matrix, self.row(n + self.p) + j);
            (self.of(&self.batch.entailed, j) * mask).write(self.matrix, self.row(n + self.p + 1) + j);
            for row in n + self.p + 2..self.n_rows {
                zero.write(self.matrix, self.row(row) + j);
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
        let zero = self.simd.splat_f64s(0.0);
        // A block has at most this many registers.
        let mut q = [zero; BLOCK];
        let mut first = [zero; BLOCK];
        let mut second = [zero; BLOCK];
        let base = n + self.p + 2;
        let mut start = 0;
        while start < n {
            let end = (start + per_block).min(n);
            for j in start..end {
                let mut square = Pack::<S, 1>::splat(self.simd, 0.0);
                for axis in 0..k {
                    let t = self.coordinate(axis, j);
                    square = t.mul_add(t, square);
                }
                square.write(&mut q, j - start);
            }
            self.model.family.profiles(Derivatives {
                simd: self.simd,
                entries: &mut q[..per_block],
                first: &mut first[..per_block],
                second: &mut second[..per_block],
                scale,
            });
            for j in start..end {
                let mask = self.mask(j);
                let phi = Pack::<S, 1>::read(self.simd, &q, j - start);
                let slope = Pack::<S, 1>::read(self.simd, &first, j - start) * (2.0 * scale) * mask;
                let bend = Pack::<S, 1>::read(self.simd, &second, j - start) * (4.0 * scale * scale) * mask;
                (phi * mask).write(self.matrix, self.row(base) + j);
                let mut term = base + 1 + k;
                for a in 0..k {
                    let t_a = self.coordinate(a, j);
                    (-(slope * t_a)).write(self.matrix, self.row(base + 1 + a) + j);
                    for b in a..k {
                        let product = bend * t_a * self.coordinate(b, j);
                        let entry = if a == b { product + slope } else { product };
                        entry.write(self.matrix, self.row(term) + j);
                        term += 1;
                    }
                }
            }
            start = end;
        }
    }
}
