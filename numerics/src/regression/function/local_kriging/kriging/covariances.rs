//! Covariances among the values, and of the values with the requested quantities.

use pulp::Simd;

use super::FactoredBatch;
use crate::machine::registers::IN_FLIGHT;
use crate::regression::function::local_kriging::batch::Batch;
use crate::regression::function::local_kriging::parts::{CROSS, QUANTITIES, VALUES};
use crate::regression::sums::side_by_side::{SideBySide, scaling};

impl<S: Simd> FactoredBatch<'_, S> {
    /// Fills the triangle with `K + noise`.
    #[inline(always)]
    pub(super) fn fill_triangle(&mut self) {
        let Batch { dimension, count, points, noise, .. } = self.batch;
        let systems = SideBySide { dimension: *dimension, count: *count, points, noise };
        systems.fill_triangle(self.kernel, &mut self.lower);
    }

    /// Fills the rows of values, of covariances with the query and, for derivatives, of φ′ and φ″.
    #[inline(always)]
    pub(super) fn fill_rows(&mut self) {
        let (values, cross) = (self.row(VALUES), self.row(CROSS));
        for j in 0..self.n {
            let mut square = self.lower.splat(0.0);
            for axis in 0..self.batch.dimension {
                let difference = self.difference(axis, j);
                square = difference.mul_add(difference, square);
            }
            self.lower.set(cross + j, square);
            self.lower.set(values + j, self.of(&self.batch.values, j));
        }
        let (length, slopes) = (self.n.next_multiple_of(IN_FLIGHT), self.row(self.parts.slopes()));
        let (bends, simd) = (self.row(self.parts.slopes() + 1), self.lower.simd);
        let (scaling, family) = (scaling(self.kernel), self.kernel.family());
        let (rows, rest) = self.lower.registers.split_at_mut(slopes);
        let entries = &mut rows[cross..][..length];
        if self.parts.order == 0 {
            scaling.covariances(simd, family, [entries]);
        } else {
            let (first, second) = rest.split_at_mut(bends - slopes);
            scaling.covariances(simd, family, [entries, &mut first[..length], &mut second[..length]]);
        }
        for j in self.batch.count..self.n {
            self.lower.set(cross + j, self.lower.splat(0.0));
        }
    }

    /// Fills the rows of the derivatives with their covariances with the values, derivatives in units of ℓ.
    ///
    /// With s = D/ℓ they are `2vφ′s_a` and `4vφ″s_as_b + 2vφ′δ_ab`.
    #[inline(always)]
    pub(super) fn fill_derivatives(&mut self) {
        let parts = self.parts;
        let (d, v, inverse) =
            (self.batch.dimension, self.kernel.variance(), 1.0 / self.kernel.length_scale());
        if parts.n_derivatives == 0 {
            return;
        }
        let (slopes, bends) = (self.row(parts.slopes()), self.row(parts.slopes() + 1));
        for j in 0..self.batch.count {
            let slope = self.lower.at(slopes + j) * (2.0 * v);
            let bend = self.lower.at(bends + j) * (4.0 * v);
            let mut second = parts.derivatives() + d;
            for a in 0..d {
                let step = self.difference(a, j) * inverse;
                self.lower.set(self.row(parts.derivatives() + a) + j, slope * step);
                if parts.order < 2 {
                    continue;
                }
                // Multiplied in this order for the reason given in `sum_derivatives`.
                let first = bend * step;
                for b in a..d {
                    let along = if a == b { slope } else { self.lower.splat(0.0) };
                    let entry = first.mul_add(self.difference(b, j) * inverse, along);
                    self.lower.set(self.row(second) + j, entry);
                    second += 1;
                }
            }
        }
        for derivative in 0..parts.n_derivatives {
            for j in self.batch.count..self.n {
                self.lower.set(self.row(parts.derivatives() + derivative) + j, self.lower.splat(0.0));
            }
        }
    }

    /// Fills the rows of the functionals with their covariances with the values.
    #[inline(always)]
    pub(super) fn fill_functionals(&mut self) {
        let parts = self.parts;
        for functional in 0..parts.n_functionals {
            let row = self.row(QUANTITIES + functional);
            for j in 0..self.n {
                let mut sum = self.lower.splat(0.0);
                for derivative in 0..parts.n_derivatives {
                    let factor =
                        self.of(&self.batch.functionals, functional * parts.n_derivatives + derivative);
                    sum = factor.mul_add(self.lower.at(self.row(parts.derivatives() + derivative) + j), sum);
                }
                self.lower.set(row + j, sum);
            }
        }
    }

    /// Fills the rows of the functions of the mean with their values at the points.
    #[inline(always)]
    pub(super) fn fill_functions(&mut self) {
        let parts = self.parts;
        for function in 0..parts.n_functions {
            let row = self.row(parts.functions() + function);
            for j in 0..self.n {
                self.lower.set(row + j, self.of(&self.batch.functions, function * self.n + j));
            }
        }
    }
}
