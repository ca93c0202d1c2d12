//! Joint draws from a posterior covariance.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef};

use super::pivoted_root::PivotedRoot;
use super::posterior::Covariance;
use crate::error::{NumericsError, Result};
use crate::machine::parallelism::parallelism;
use crate::machine::random::Random;
use crate::observer::{Observer, Stage};

/// Multiple of `ε m k₀` up to which remaining variances are rounding: m queries, prior variance k₀.
const ROUNDING: f64 = 64.0;

/// Draws computed at once.
const DRAWS_PER_BLOCK: usize = 256;

/// Bit that tells the random numbers of the noise from those of the function.
const NOISE_STREAM: u64 = 1 << 63;

/// Identity of a sequence of draws: a seed, and which of several lists of values the draws are for.
#[derive(Debug, Clone, Copy)]
pub struct Stream {
    pub seed: u64,
    pub list: u64,
}

/// A root L of a covariance `C ≈ LLᵀ`, `[m, m]`, with the rank that it has in float64.
pub struct Root {
    /// The r independent directions, `[r, m]` row by row.
    directions: Vec<f64>,
    n_queries: usize,
    /// Standard deviation of independent noise at each query.
    noise_deviation: f64,
}

impl Root {
    /// Factorizes a covariance by Cholesky with complete pivoting (Higham 2002, sec. 10.3).
    ///
    /// The factorization ends when the remaining variances are rounding, i.e. at most `64 ε m k₀`. k₀ is the
    /// prior variance in the unit of the covariance.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`]. [`NumericsError::WeightsOverflow`] if an entry is not finite.
    pub fn of(covariance: &Covariance, prior_variance: f64, observer: &dyn Observer) -> Result<Self> {
        observer.enter(Stage::Solve);
        observer.checkpoint()?;
        let m = covariance.latent.len().isqrt();
        let rounding = ROUNDING * f64::EPSILON * m as f64 * prior_variance;
        // If no variance is above rounding, there is nothing to factorize. NaN goes on to the next check.
        if covariance.latent.iter().step_by(m + 1).all(|variance| *variance <= rounding) {
            return Ok(Self { directions: Vec::new(), n_queries: m, noise_deviation: 0.0 });
        }
        if covariance.latent.iter().any(|entry| !entry.is_finite()) {
            return Err(NumericsError::WeightsOverflow);
        }
        let mut factor = covariance.latent.clone();
        let PivotedRoot { order, rank } = PivotedRoot::of(&mut factor, m, rounding, observer)?;
        let mut directions = vec![0.0; rank * m];
        for (column, direction) in directions.chunks_exact_mut(m).enumerate() {
            (column..m).for_each(|row| direction[order[row]] = factor[column * m + row]);
        }
        Ok(Self { directions, n_queries: m, noise_deviation: 0.0 })
    }

    /// Adds independent noise of this variance at each query: draws are then of observations.
    pub fn with_noise(self, variance: f64) -> Self {
        Self { noise_deviation: variance.sqrt(), ..self }
    }

    /// Draws `[count, m]` about means `[m]`.
    ///
    /// A draw depends on the stream and its index in the stream, but not on `count`.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub fn draw(
        &self,
        means: &[f64],
        count: usize,
        stream: Stream,
        observer: &dyn Observer,
    ) -> Result<Vec<f64>> {
        let m = self.n_queries;
        let rank = self.directions.len().checked_div(m).unwrap_or(0);
        let mut normals = vec![0.0; rank * count.min(DRAWS_PER_BLOCK)];
        let mut draws: Vec<f64> = means.iter().copied().cycle().take(m * count).collect();
        let directions = MatRef::from_column_major_slice(&self.directions, m, rank);
        for (block, draws) in draws.chunks_mut(m * DRAWS_PER_BLOCK).enumerate() {
            observer.checkpoint()?;
            let (first, count) = (block * DRAWS_PER_BLOCK, draws.len() / m);
            let normals = &mut normals[..rank * count];
            for (draw, numbers) in normals.chunks_exact_mut(rank.max(1)).enumerate() {
                Random::of(stream.seed, (stream.list << 32) ^ (first + draw) as u64).fill_normal(numbers);
            }
            let out = MatMut::from_column_major_slice_mut(draws, m, count);
            let normals = MatRef::from_column_major_slice(normals, rank, count);
            matmul(out, Accum::Add, directions, normals, 1.0, parallelism((2 * m * rank * count) as f64));
            if self.noise_deviation > 0.0 {
                self.add_noise(draws, first, stream);
            }
        }
        Ok(draws)
    }

    /// Adds noise to draws `[count, m]` of a stream from this index on.
    fn add_noise(&self, draws: &mut [f64], first: usize, stream: Stream) {
        let mut noise = vec![0.0; self.n_queries];
        for (at, draw) in draws.chunks_exact_mut(self.n_queries).enumerate() {
            let index = NOISE_STREAM ^ (stream.list << 32) ^ (first + at) as u64;
            Random::of(stream.seed, index).fill_normal(&mut noise);
            draw.iter_mut().zip(&noise).for_each(|(value, z)| *value += self.noise_deviation * z);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::kernel::Kernel;
    use crate::observer::Unobserved;
    use crate::points::cloud::Cloud;
    use crate::regression::function::posterior::covariance;
    use crate::regression::solver::{Solver, System};
    use crate::regression::sums::regularization::Regularization;
    use crate::testing::{all_families, fibonacci_sphere};

    #[test]
    fn draws_have_the_mean_and_the_covariance_of_the_posterior() {
        // Queries at points of the cloud, between them, a repeated one, and a distant one.
        let mut queries = fibonacci_sphere(12).coordinates().to_vec();
        queries.extend([0.0, 0.6, 0.8, 0.0, 0.6, 0.8, 50.0, 0.0, 0.0]);
        queries.extend_from_slice(&fibonacci_sphere(40).coordinates()[..9]);
        let queries = Cloud::new(queries, 3).unwrap();
        let (m, count) = (queries.n_points(), 20_000);
        for family in all_families() {
            let kernel = Kernel::new(family, 0.9, 2.0).unwrap();
            let alpha = Regularization::uniform(1e-8).unwrap();
            let system = System::new(Arc::new(fibonacci_sphere(40)), kernel.clone(), alpha).unwrap();
            let solver = Solver::dense(system, &Unobserved).unwrap();
            let covariance = covariance(&solver, &queries, &Unobserved).unwrap();
            let root = Root::of(&covariance, kernel.at_zero(), &Unobserved).unwrap();
            let means: Vec<f64> = (0..m).map(|i| i as f64).collect();
            let draws = root.draw(&means, count, Stream { seed: 3, list: 0 }, &Unobserved).unwrap();
            let few = root.draw(&means, 5, Stream { seed: 3, list: 0 }, &Unobserved).unwrap();
            assert_eq!(few, draws[..5 * m], "a draw does not depend on the others");
            let at = |draw: usize, query: usize| draws[draw * m + query] - means[query];
            for i in 0..m {
                for j in 0..=i {
                    let sum: f64 = (0..count).map(|draw| at(draw, i) * at(draw, j)).sum();
                    let variances = covariance.latent[i * (m + 1)] * covariance.latent[j * (m + 1)];
                    // Five standard errors of a product, plus what the factorization leaves out.
                    let allowed = 5.0 * (2.0 * variances / count as f64).sqrt() + 1e-12;
                    let off = (sum / count as f64 - covariance.latent[i * m + j]).abs();
                    assert!(off <= allowed, "{family:?} {i} {j}: {off} > {allowed}");
                }
            }
            assert!((0..count).all(|draw| (at(draw, 12) - at(draw, 13)).abs() < 1e-5), "{family:?}");
        }
    }

    #[test]
    fn what_is_known_exactly_does_not_vary() {
        for variance in [0.0, 1e-17] {
            let covariance = Covariance { latent: vec![0.0, 0.0, 0.0, variance], clamped: vec![0] };
            let root = Root::of(&covariance, 1.0, &Unobserved).unwrap();
            let draws = root.draw(&[1.0, 2.0], 2, Stream { seed: 0, list: 0 }, &Unobserved).unwrap();
            assert_eq!(draws, [1.0, 2.0, 1.0, 2.0]);
        }
    }
}
