//! Prices of local kriging, which solves a system of the nearest points around each query.

use super::NEIGHBOURS;
use crate::machine::lanes::MAX_LANES;
use crate::machine::price::{Price, Sizes};
use crate::points::sampling::{sampling_flops, sampling_price};

/// Flops of kriging at one query and of the search for its neighbours.
const FLOPS_PER_KRIGING: f64 = 1e6;

/// Memory is counted for at most this many threads, each of which solves [`MAX_LANES`] queries side by side.
const MAX_KRIGING_THREADS: usize = 64;

/// The price of preparing the model: a check of the system, and a sampling of its cloud.
///
/// The cloud is sampled here only where duplicates are merged or the kernel stretches it.
pub(crate) fn making_price(n_points: usize, dimension: usize, is_merged: bool, is_stretched: bool) -> Price {
    let numbers = n_points.saturating_mul((dimension + 4) * size_of::<f64>());
    let looking = if is_merged || is_stretched { sampling_flops(n_points, dimension) } else { 0.0 };
    let sampled = sampling_price(n_points, dimension).n_bytes.saturating_add(numbers);
    Price {
        n_bytes: sampled.saturating_mul(1 + usize::from(is_stretched)).saturating_add(1 << 10),
        // Coinciding points are found by sorting.
        flops: 100.0 * n_points as f64 + looking,
    }
}

/// The price of values, derivatives and variances from the points nearest to each query.
///
/// Each query has `n_deviations` deviations.
pub(crate) fn kriging_price(n_deviations: usize, sizes: Sizes) -> Price {
    let ([n, m, d], Sizes { n_points, n_queries, dimension }) = (sizes.as_f64(), sizes);
    let n_threads = n_queries.div_ceil(MAX_LANES).min(MAX_KRIGING_THREADS);
    // Each query holds a triangle of its system and some rows.
    let of_thread = MAX_LANES * NEIGHBOURS * (NEIGHBOURS / 2 + 12 + dimension + n_deviations);
    // Searches in many dimensions visit most of the cloud.
    let visited = n.min(5.0 * NEIGHBOURS as f64 * 2f64.powi(dimension.min(60) as i32));
    let substituted = 2.0 * n_deviations as f64 * (NEIGHBOURS as f64).powi(2);
    let flops = m * (FLOPS_PER_KRIGING + substituted + visited * (3.0 * d + 10.0));
    // Results, and a copy of them for the answer.
    let at_queries = n_queries.saturating_mul(2 + 3 * n_deviations);
    let n_numbers = (n_threads * of_thread).saturating_add(n_points);
    Price::of_numbers(n_numbers.saturating_add(sizes.jets()).saturating_add(at_queries), flops)
}

/// The price of an operator on kriged values.
///
/// It needs derivatives up to second order with their covariances, among the points or among means of them.
/// These means are found when the cloud is sampled, so sampling is included.
pub(crate) fn kriged_operator_price(sizes: Sizes) -> Price {
    let n_derivatives = sizes.dimension.saturating_mul(sizes.dimension + 3) / 2;
    kriging_price(n_derivatives, sizes).and(sampling_price(sizes.n_points, sizes.dimension))
}
