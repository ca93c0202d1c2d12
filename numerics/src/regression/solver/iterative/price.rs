//! Prices of conjugate gradients, whose number of iterations is known only when they end.

use super::SOLVED_AT_ONCE;
use super::columns::MOST;
use crate::machine::price::{Price, Sizes};
use crate::regression::sums::fast::FastSums;
use crate::regression::sums::price::pair_flops;

/// Iterations that prices assume. Matérn kernels and Laplace take 5 to 15 to a residual of 1e-8.
pub(crate) const EXPECTED_ITERATIONS: f64 = 8.0;

/// Pairs that a fast product takes for each point. A tenth of it is enough for the last iterations.
const FAST_PAIRS: f64 = 30_000.0;

/// The price of the sparse factor: for each point a small factorization, and the search for its neighbours.
pub(crate) fn iterative_price(n_points: usize, dimension: usize) -> Price {
    let n_bytes = MOST * (size_of::<f32>() + size_of::<u32>());
    let numbers = n_bytes / size_of::<f64>() + 5 + 4 * dimension;
    let flops = (MOST as f64).powi(3) + 40.0 * (MOST * MOST) as f64 + 20_000.0;
    Price::of_numbers(n_points.saturating_mul(numbers), n_points as f64 * flops)
}

/// The price of weights for new values: a product for each iteration, and a pass over half of the pairs for
/// the residual.
pub(crate) fn iterative_fit_price(n_points: usize, dimension: usize) -> Price {
    let n = n_points as f64;
    let pairs = EXPECTED_ITERATIONS * n * pairs_per_point(n_points, dimension, 0.5) + 0.5 * n * n;
    Price::of_numbers(n_points.saturating_mul(20), pairs * pair_flops(dimension, 0))
}

/// The price of covariances of functionals, `held` at once: each is a solve, and those of a block share their
/// products.
pub(crate) fn iterative_covariances_price(held: usize, sizes: Sizes) -> Price {
    let Sizes { n_points, n_queries, dimension } = sizes;
    let (n, blocks) = (n_points as f64, n_queries.div_ceil(SOLVED_AT_ONCE) as f64);
    let of_pair = blocks * pair_flops(dimension, 0) + 2.0 * n_queries as f64;
    let flops = EXPECTED_ITERATIONS * n * pairs_per_point(n_points, dimension, 1.0) * of_pair;
    let columns = 5 * n_queries.min(held) + 16 * n_queries.min(SOLVED_AT_ONCE);
    Price::of_numbers(n_points.saturating_mul(columns), flops)
}

/// Pairs that a product takes for each point, where a plain one takes this share of all.
fn pairs_per_point(n_points: usize, dimension: usize, share: f64) -> f64 {
    let plain = share * n_points as f64;
    if dimension > FastSums::MAX_DIMENSION { plain } else { plain.min(FAST_PAIRS) }
}
