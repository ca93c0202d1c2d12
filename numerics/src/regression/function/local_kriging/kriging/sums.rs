//! Results of a batch, from inner products of the rows below the factor.

use pulp::Simd;

use super::FactoredBatch;
use crate::machine::lanes::triangle;
use crate::regression::function::local_kriging::parts::{CROSS, QUANTITIES, RowOffsets, VALUES};

impl<S: Simd> FactoredBatch<'_, S> {
    /// Writes the results of the batch, in the order of [`RowOffsets`].
    #[inline(always)]
    pub(super) fn sum_up(&mut self, found: &mut [S::f64s]) {
        let (d, n, parts) = (self.batch.dimension, self.n, self.parts);
        let places = RowOffsets::of(d);
        let (values, cross, weights) = (self.row(VALUES), self.row(CROSS), self.row(parts.weights()));
        self.lower.product(values, cross).write(found, 0);
        let mut n_dependent = self.lower.splat(0.0);
        for i in 0..n {
            n_dependent =
                n_dependent + self.lower.at(triangle(i) + i).select_below(f64::MIN_POSITIVE, 1.0, 0.0);
        }
        n_dependent.write(found, places.n_dependent);
        if parts.variances {
            self.lower.product(cross, cross).write(found, places.explained);
            self.lower.back_substitute(cross, weights);
            self.lower.product(weights, weights).write(found, places.norm_squared);
        }
        for quantity in 0..parts.n_quantities() {
            let row = self.row(QUANTITIES + quantity);
            self.lower.product(row, row).write(found, places.of_quantities() + quantity);
        }
        let mut place = places.of_functions(&parts);
        for function in 0..parts.n_functions {
            let row = self.row(parts.functions() + function);
            self.lower.product(row, cross).write(found, place);
            for quantity in 0..parts.n_quantities() {
                let other = self.row(QUANTITIES + quantity);
                self.lower.product(row, other).write(found, place + 1 + quantity);
            }
            place += 1 + parts.n_quantities();
        }
        if parts.order > 0 {
            self.lower.back_substitute(values, weights);
            self.sum_derivatives(found);
        }
    }

    /// Writes `Σλφ′D_a`, `Σλφ″D_aD_b` and `Σλφ′`, and overwrites the rows of φ′ and φ″ by λφ′ and λφ″.
    #[inline(always)]
    fn sum_derivatives(&mut self, found: &mut [S::f64s]) {
        let (d, count) = (self.batch.dimension, self.batch.count);
        let (weights, slopes) = (self.row(self.parts.weights()), self.row(self.parts.slopes()));
        let bends = self.row(self.parts.slopes() + 1);
        let mut trace = self.lower.splat(0.0);
        for j in 0..count {
            let weight = self.lower.at(weights + j);
            let slope = self.lower.at(slopes + j) * weight;
            trace = trace + slope;
            self.lower.set(slopes + j, slope);
            self.lower.set(bends + j, self.lower.at(bends + j) * weight);
        }
        let mut place = 1 + d;
        for a in 0..d {
            let mut sum = self.lower.splat(0.0);
            for j in 0..count {
                sum = self.lower.at(slopes + j).mul_add(self.difference(a, j), sum);
            }
            sum.write(found, 1 + a);
            if self.parts.order < 2 {
                continue;
            }
            for b in a..d {
                let mut sum = self.lower.splat(0.0);
                for j in 0..count {
                    // φ″ is 0 at long differences. Multiplied first, it keeps the product of two of them
                    // finite.
                    let first = self.lower.at(bends + j) * self.difference(a, j);
                    sum = first.mul_add(self.difference(b, j), sum);
                }
                sum.write(found, place);
                place += 1;
            }
        }
        trace.write(found, 1 + d + triangle(d));
    }
}
