//! Likelihood, trend and derivatives from inner products of the rows below the factor.

use pulp::Simd;
use smallvec::SmallVec;

use super::doubt::Doubt;
use super::model::prior_covariance;
use super::{FactoredBatch, LEAST_HEIGHT, ModelResult};
use crate::machine::lanes::{MAX_LANES, triangle};

/// Places of registers after the rows.
struct Places {
    /// Inner products of the rows, `[n_kept, n_kept]`, of which the lower triangle is used.
    products: usize,
    n_kept: usize,
    /// Rᵀ, with the right-hand sides in the columns beyond it, `[p_trend, width]`.
    small: usize,
    width: usize,
}

impl Places {
    #[inline(always)]
    fn product(&self, i: usize, j: usize) -> usize {
        self.products + i.max(j) * self.n_kept + i.min(j)
    }

    #[inline(always)]
    fn small(&self, i: usize, column: usize) -> usize {
        self.small + i * self.width + column
    }
}

impl<S: Simd> FactoredBatch<'_, S> {
    /// Computes the results of all lanes from inner products of the rows below the factor.
    #[inline(always)]
    pub(super) fn solve(&mut self, predicts: bool) -> SmallVec<[ModelResult; MAX_LANES]> {
        let width = self.p_trend + 2 + self.p;
        let n_kept = if predicts { width } else { self.p_trend + 2 };
        let places = Places { products: self.scratch, n_kept, small: self.scratch + n_kept * n_kept, width };
        self.solve_trend(&places);
        self.leave_residuals(&places);
        if predicts {
            self.predict(&places);
        }
        self.lanes(&places, predicts)
    }

    #[inline(always)]
    fn multiply(&mut self, i: usize, j: usize, places: &Places) {
        let product = self.lower.product(self.lower.row(self.n + i), self.lower.row(self.n + j));
        self.lower.set(places.product(i, j), product);
    }

    /// Factorizes A = FᵀK⁻¹F = RRᵀ, and computes R⁻¹(b, U) with b = FᵀK⁻¹z and U = I − FᵀK⁻¹C, row by row.
    #[inline(always)]
    fn solve_trend(&mut self, places: &Places) {
        let data = self.p_trend..self.p_trend + 2;
        for i in 0..places.n_kept {
            // Closures would not be compiled for the registers of this machine.
            for j in 0..=i {
                if !data.contains(&j) {
                    self.multiply(i, j, places);
                }
            }
        }
        let (zero, one) = (self.lower.splat(0.0), self.lower.splat(1.0));
        for i in 0..self.p_trend {
            for j in i..places.n_kept {
                let product = self.lower.at(places.product(j, i));
                let mut value = if j < data.end {
                    product
                } else {
                    let unit = if j - data.end == i { one } else { zero };
                    unit - product
                };
                // By columns of R: entry (i, j) is that of Rᵀ for j < p_trend, of R⁻¹(b, U) beyond.
                for l in 0..i {
                    let (of_i, of_j) = (places.small(l, i), places.small(l, j));
                    value = value - self.lower.at(of_i) * self.lower.at(of_j);
                }
                let value = if i == j { value.sqrt() } else { value / self.lower.at(places.small(i, i)) };
                self.lower.set(places.small(i, j), value);
            }
        }
    }

    /// Subtracts the trend from the rows of heights and entailed heights, whose coefficients R⁻ᵀR⁻¹b take
    /// the place of R⁻¹b. Also multiplies the residuals with each other and with C.
    ///
    /// A difference of quadratic forms would lose the digits of small residuals.
    #[inline(always)]
    fn leave_residuals(&mut self, places: &Places) {
        let (n, p_trend) = (self.n, self.p_trend);
        for column in p_trend..p_trend + 2 {
            for i in (0..p_trend).rev() {
                let mut value = self.lower.at(places.small(i, column));
                for m in i + 1..p_trend {
                    let (entry, found) = (places.small(i, m), places.small(m, column));
                    value = value - self.lower.at(entry) * self.lower.at(found);
                }
                let value = value / self.lower.at(places.small(i, i));
                self.lower.set(places.small(i, column), value);
            }
            for j in 0..n {
                let mut value = self.lower.at(self.lower.row(n + column) + j);
                for i in 0..p_trend {
                    let trend = self.lower.at(self.lower.row(n + i) + j);
                    value = value - self.lower.at(places.small(i, column)) * trend;
                }
                self.lower.put(n + column, j, value);
            }
            for j in p_trend..=column {
                self.multiply(column, j, places);
            }
        }
        for i in p_trend + 2..places.n_kept {
            for j in p_trend..p_trend + 2 {
                self.multiply(i, j, places);
            }
        }
    }

    /// Computes means and covariances (over s²) of the derivatives, in place of the products with C.
    #[inline(always)]
    fn predict(&mut self, places: &Places) {
        let (p, p_trend) = (self.p, self.p_trend);
        let first = p_trend + 2;
        let prior = prior_covariance(self.model, self.k);
        for i in 0..p {
            for column in p_trend..first {
                let of_trend = self.lower.at(places.small(i, column));
                let place = places.product(first + i, column);
                self.lower.set(place, of_trend + self.lower.at(place));
            }
            for j in 0..=i {
                let place = places.product(first + i, first + j);
                let mut covariance = prior[i * p + j] - self.lower.at(place);
                for l in 0..p_trend {
                    let (u_i, u_j) = (places.small(l, first + i), places.small(l, first + j));
                    covariance = self.lower.at(u_i).mul_add(self.lower.at(u_j), covariance);
                }
                self.lower.set(place, covariance);
            }
        }
    }

    /// Collects the numbers of each lane.
    #[inline(always)]
    fn lanes(&self, places: &Places, predicts: bool) -> SmallVec<[ModelResult; MAX_LANES]> {
        let (n, p, p_trend) = (self.n, self.p, self.p_trend);
        let numbers: &[f64] = bytemuck::cast_slice(&*self.lower.registers);
        let lanes = S::F64_LANES;
        let at = |register: usize, lane: usize| numbers[register * lanes + lane];
        let mut found = SmallVec::new();
        for lane in 0..lanes {
            let n_points: f64 = self.batch.is_point[lane..].iter().step_by(lanes).sum();
            let freedom = n_points - p_trend as f64;
            let form = |i: usize, j: usize| at(places.product(p_trend + i, p_trend + j), lane);
            let log_k = log_sum((0..n).map(|i| at(triangle(i) + i, lane)));
            let log_r = log_sum((0..p_trend).map(|i| at(places.small(i, i), lane)));
            // An exact plane or sphere leaves no residual, and 0 has no logarithm.
            let heights = form(0, 0).max(freedom * LEAST_HEIGHT * LEAST_HEIGHT);
            let doubt = Doubt::of(heights, form(1, 0), form(1, 1).max(0.0), freedom);
            let independence =
                |i: usize| at(places.small(i, i), lane).powi(2) / at(places.product(i, i), lane);
            let independence = (0..p_trend).map(independence).fold(1.0, f64::min);
            let log_likelihood = if self.model.trend.is_determined(freedom, independence) {
                log_k - log_r - doubt.log_penalty - 0.5 * freedom * doubt.quadratic.ln()
            } else {
                f64::NAN
            };
            let scale = doubt.quadratic / freedom;
            let mut kriged = ModelResult { log_likelihood, scale, freedom, ..ModelResult::default() };
            if predicts {
                let first = p_trend + 2;
                let mean = |i: usize| at(places.product(first + i, p_trend), lane);
                let effect = |i: usize| at(places.product(first + i, p_trend + 1), lane);
                let covariance = |i: usize, j: usize| at(places.product(first + i, first + j), lane);
                kriged.means = (0..p).map(|i| mean(i) - doubt.mean * effect(i)).collect();
                let entry =
                    |i: usize, j: usize| scale * covariance(i, j) + doubt.variance * effect(i) * effect(j);
                kriged.covariance = (0..p * p).map(|at| entry(at / p, at % p)).collect();
            }
            found.push(kriged);
        }
        found
    }
}

/// Sum of the logarithms of factors. There may be many, so 8 at a time are multiplied, which stays within
/// float64.
fn log_sum(factors: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut product) = (0.0, 1.0);
    for (i, factor) in factors.enumerate() {
        product *= factor;
        if i % 8 == 7 {
            sum += f64::ln(product);
            product = 1.0;
        }
    }
    sum + product.ln()
}
