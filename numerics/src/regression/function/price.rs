//! Prices of functions through values, and of their uncertainty.

use super::COLUMNS_AT_ONCE;
use super::errors::JUDGED_AT_ONCE;
use crate::machine::price::{Price, Sizes};
use crate::points::sampling::sampling_price;
use crate::regression::solver::price::{numbers_at_point, whitening_flops};
use crate::regression::sums::many::QUERIES_PER_BLOCK;
use crate::regression::sums::price::pair_flops;

/// The price of a function through new values, with derivatives up to `order`.
pub(crate) fn function_price(order: usize, sizes: Sizes) -> Price {
    let [n, m, _] = sizes.as_f64();
    let at_points = sizes.n_points.saturating_mul(numbers_at_point(sizes.dimension));
    let flops = n * (40.0 * n + pair_flops(sizes.dimension, order) * m);
    Price::of_numbers(at_points.saturating_add(sizes.jets()), flops)
}

/// The price of a function as a Gaussian process, with variances or with a covariance of all queries.
pub(crate) fn posterior_price(has_variances: bool, has_covariance: bool, sizes: Sizes) -> Price {
    let ([n, m, _], Sizes { n_points, n_queries, dimension }) = (sizes.as_f64(), sizes);
    let whitened = match (has_covariance, has_variances) {
        (true, _) => n_queries,
        (false, true) => n_queries.min(COLUMNS_AT_ONCE),
        (false, false) => 0,
    };
    let flops = 40.0 * n * (n + m)
        + if whitened > 0 { n * m * whitening_flops(n) } else { 0.0 }
        + if has_covariance { n * m * m } else { 0.0 };
    let n_numbers = whitened.saturating_add(numbers_at_point(dimension)).saturating_mul(n_points);
    Price::of_numbers(n_numbers.saturating_add(n_queries.saturating_mul(2 + dimension)), flops)
}

/// Bytes kept for each list of values, besides its numbers at points and queries. `FLOPS_PER_LIST` is the
/// work of keeping them.
const BYTES_PER_LIST: usize = 600;
const FLOPS_PER_LIST: f64 = 5000.0;

/// The price of k lists of values besides the first.
///
/// Solves and sums run as matrix products. The `n_derivatives` derivatives are computed list by list.
pub fn many_price(n_lists: usize, n_derivatives: usize, sizes: Sizes) -> Price {
    let ([n, m, _], k) = (sizes.as_f64(), n_lists as f64);
    let of_derivatives = if n_derivatives > 0 { 40.0 * n * m } else { 0.0 };
    let at_queries = sizes.n_queries.saturating_mul(1 + n_derivatives);
    let numbers = sizes.n_points.saturating_mul(6).saturating_add(at_queries);
    let n_bytes =
        n_lists.saturating_mul(numbers.saturating_mul(size_of::<f64>()).saturating_add(BYTES_PER_LIST));
    Price { n_bytes, flops: k * (6.0 * n * n + 2.0 * n * m + of_derivatives + FLOPS_PER_LIST) }
}

/// The price of `n_draws` joint draws at m queries besides their covariance: its factor, and the draws.
pub(crate) fn samples_price(n_queries: usize, n_draws: usize) -> Price {
    let (m, count) = (n_queries as f64, n_draws as f64);
    let numbers = n_queries.saturating_mul(n_queries.saturating_mul(3).saturating_add(n_draws));
    Price::of_numbers(numbers, m * m * (m / 3.0 + 2.0 * count))
}

/// The price of the deviations of `n_functionals` functionals, which are found like variances.
pub(crate) fn deviations_price(n_points: usize, n_functionals: usize, dimension: usize) -> Price {
    let n = n_points as f64;
    let n_at_once = n_functionals.min(COLUMNS_AT_ONCE);
    // Columns for a mean are included.
    let columns = n_points.saturating_mul(n_at_once + dimension + 5).saturating_mul(size_of::<f64>());
    let found = n_functionals.saturating_mul(4 * size_of::<f64>());
    let n_bytes = columns.saturating_add(found).saturating_add(n_at_once * functional_bytes(dimension));
    let flops = n * (whitening_flops(n) + covariance_flops(dimension)) * n_functionals as f64;
    Price { n_bytes, flops }
}

/// The price of judging the answers of an operator by `n_functionals` functionals.
///
/// It consists of their weights and of the covariances of another process with all values.
pub(crate) fn judging_price(n_functionals: usize, sizes: Sizes) -> Price {
    let Sizes { n_points, n_queries, dimension } = sizes;
    let (n, k) = (n_points as f64, n_functionals as f64);
    let n_blocks = n_functionals.div_ceil(JUDGED_AT_ONCE) as f64;
    let of_mean = 5 * (dimension + 1);
    let columns =
        n_points.saturating_mul(3 * n_functionals.min(JUDGED_AT_ONCE) + QUERIES_PER_BLOCK + of_mean);
    let numbers = columns.saturating_add(n_queries.saturating_mul(dimension + 3));
    let judging = Price {
        n_bytes: numbers
            .saturating_mul(size_of::<f64>())
            .saturating_add(n_functionals * functional_bytes(dimension)),
        flops: n * n * (4.0 * k + 40.0 * n_blocks)
            + 2.0 * n * k * covariance_flops(dimension)
            + 1000.0 * n_queries as f64,
    };
    // The cloud is sampled unless that was done before.
    judging.and(sampling_price(n_points, dimension))
}

/// Bytes of a functional of jets while it is evaluated, counted twice.
fn functional_bytes(dimension: usize) -> usize {
    let beyond_the_stack = if dimension * dimension > 16 { dimension * dimension } else { 0 };
    2 * (400 + beyond_the_stack * size_of::<f64>())
}

/// Flops of the covariance of a functional of jets with a value: distance, kernel, and the terms of the
/// functional.
fn covariance_flops(dimension: usize) -> f64 {
    60.0 + 10.0 * dimension as f64
}
