//! Likelihood, trend and derivatives from inner products of the rows below the factor.

use pulp::Simd;
use smallvec::SmallVec;

use super::doubt::Doubt;
use super::model::prior_covariance;
use super::{Factored, Kriged, LEAST_HEIGHT};
use crate::machine::lanes::{MAX_LANES, triangle};

impl<S: Simd> Factored<'_, S> {
    /// Computes the results of all lanes from inner products of the rows below the factor.
    #[inline(always)]
    pub(super) fn solve(&mut self, predicts: bool) -> SmallVec<[Kriged; MAX_LANES]> {
        let (p, p_trend) = (self.p, self.p_trend);
        let n_kept = if predicts { 2 * p + 2 } else { p + 2 };
        let start = self.scratch;
        for i in 0..n_kept {
            for j in 0..=i {
                let product = self.lower.product(self.lower.row(self.n + i), self.lower.row(self.n + j));
                self.lower.set(start + i * n_kept + j, product);
            }
        }
        // A = FᵀK⁻¹F = RRᵀ, then R⁻¹(b, U) with b = FᵀK⁻¹z and U = I − FᵀK⁻¹C, row by row.
        let entry = |i: usize, j: usize| start + i.max(j) * n_kept + i.min(j);
        let small = start + n_kept * n_kept;
        let width = p_trend + 2 + p;
        let one = self.lower.splat(1.0);
        let zero = self.lower.splat(0.0);
        let n_columns = if predicts { width } else { p_trend + 2 };
        for i in 0..p_trend {
            for j in 0..n_columns {
                let mut value = if j < p_trend {
                    self.lower.at(entry(j, i))
                } else if j < p_trend + 2 {
                    self.lower.at(entry(j - p_trend + p, i))
                } else {
                    let unit = if j - p_trend - 2 == i { one } else { zero };
                    unit - self.lower.at(entry(j - p_trend + p, i))
                };
                if j < i {
                    continue;
                }
                // By columns of R: entry (i, j) is that of Rᵀ for j < p_trend, of R⁻¹(b, U) beyond.
                for l in 0..i {
                    value =
                        value - self.lower.at(small + l * width + i) * self.lower.at(small + l * width + j);
                }
                let value = if i == j { value.sqrt() } else { value / self.lower.at(small + i * width + i) };
                self.lower.set(small + i * width + j, value);
            }
        }
        // Quadratic forms of heights and entailed heights, with the trend projected out of K⁻¹.
        for (i, j) in [(0, 0), (1, 0), (1, 1)] {
            let mut quadratic = self.lower.at(entry(p + i, p + j));
            for l in 0..p_trend {
                let row = small + l * width + p_trend;
                quadratic = quadratic - self.lower.at(row + i) * self.lower.at(row + j);
            }
            self.lower.set(entry(p + i, p + j), quadratic);
        }
        if predicts {
            self.predict(start, n_kept, small, width);
        }
        self.lanes(start, n_kept, small, width, predicts)
    }

    /// Computes means and covariances (over s²) of the derivatives, in place of the products with C.
    #[inline(always)]
    fn predict(&mut self, start: usize, n_kept: usize, small: usize, width: usize) {
        let (p, p_trend) = (self.p, self.p_trend);
        let prior = prior_covariance(self.model, self.k);
        for i in 0..p {
            let row = start + (p + 2 + i) * n_kept;
            let u_i = small + p_trend + 2 + i;
            for data in 0..2 {
                let mut mean = self.lower.at(row + p + data);
                for l in 0..p_trend {
                    let b = self.lower.at(small + l * width + p_trend + data);
                    mean = self.lower.at(u_i + l * width).mul_add(b, mean);
                }
                self.lower.set(row + p + data, mean);
            }
            for j in 0..=i {
                let u_j = small + p_trend + 2 + j;
                let mut covariance = prior[i * p + j] - self.lower.at(row + p + 2 + j);
                for l in 0..p_trend {
                    covariance =
                        self.lower.at(u_i + l * width).mul_add(self.lower.at(u_j + l * width), covariance);
                }
                self.lower.set(row + p + 2 + j, covariance);
            }
        }
    }

    /// Collects the numbers of each lane.
    #[inline(always)]
    fn lanes(
        &self,
        start: usize,
        n_kept: usize,
        small: usize,
        width: usize,
        predicts: bool,
    ) -> SmallVec<[Kriged; MAX_LANES]> {
        let (n, p, p_trend) = (self.n, self.p, self.p_trend);
        let numbers: &[f64] = bytemuck::cast_slice(&*self.lower.registers);
        let lanes = S::F64_LANES;
        let at = |register: usize, lane: usize| numbers[register * lanes + lane];
        let mut found = SmallVec::new();
        for lane in 0..lanes {
            let n_points: f64 = self.batch.is_point[lane..].iter().step_by(lanes).sum();
            let freedom = n_points - p_trend as f64;
            let form = |i: usize, j: usize| at(start + (p + i) * n_kept + p + j, lane);
            let log_k = log_sum((0..n).map(|i| at(triangle(i) + i, lane)));
            let log_r = log_sum((0..p_trend).map(|i| at(small + i * width + i, lane)));
            // An exact plane or sphere leaves no residual, and 0 has no logarithm.
            let heights = form(0, 0).max(freedom * LEAST_HEIGHT * LEAST_HEIGHT);
            let doubt = Doubt::of(heights, form(1, 0), form(1, 1).max(0.0), freedom);
            let log_likelihood = log_k - log_r - doubt.log_penalty - 0.5 * freedom * doubt.quadratic.ln();
            let scale = doubt.quadratic / freedom;
            let mut kriged = Kriged { log_likelihood, scale, freedom, ..Kriged::default() };
            if predicts {
                let row = |i: usize| start + (p + 2 + i) * n_kept + p;
                let effect = |i: usize| at(row(i) + 1, lane);
                let covariance = |i: usize, j: usize| at(row(i.max(j)) + 2 + i.min(j), lane);
                kriged.means = (0..p).map(|i| at(row(i), lane) - doubt.mean * effect(i)).collect();
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
