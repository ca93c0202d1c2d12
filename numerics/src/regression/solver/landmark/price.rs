//! Prices of landmarks, whose number is known only when they are chosen.

use super::MOST_PRECONDITIONED;
use super::pivots::{SAMPLE, most_landmarks};
use super::rows::{BLOCK, MOST_KEPT};
use crate::machine::price::{Price, Sizes};
use crate::regression::sums::price::pair_flops;

/// Landmarks that prices assume. A torus of radii 2 and ½ has 920 at the length scale 1 without noise, and
/// half as many with noise.
const EXPECTED: usize = 800;

/// Prices of choosing landmarks and of their normal equations.
pub(crate) struct LandmarkPrice {
    pub expected: Price,
    pub at_most: Price,
}

impl LandmarkPrice {
    /// A choice, a pass over the points, and part of another one, since some landmarks are completed.
    pub(crate) fn of(n_points: usize, dimension: usize) -> Self {
        let of_rank = |rank: usize, n_passes: f64| {
            let n_numbers = (2 * SAMPLE.min(n_points) * rank)
                .saturating_add(MOST_KEPT.min(rank.saturating_mul(n_points)))
                .saturating_add(4 * rank * rank + 3 * BLOCK * rank)
                .saturating_add(n_points.saturating_mul(8 + dimension));
            Price::of_numbers(n_numbers, n_passes * n_points as f64 * (rank * rank) as f64)
        };
        let at_most = most_landmarks(2 * SAMPLE.min(n_points)).min(n_points);
        Self { expected: of_rank(EXPECTED.min(n_points), 4.0), at_most: of_rank(at_most, 9.0) }
    }
}

/// Sizes of variances, in which the landmarks stand for all points.
pub(crate) fn on_landmarks(sizes: Sizes) -> Sizes {
    Sizes { n_points: sizes.n_points.min(EXPECTED), ..sizes }
}

/// Sizes of a function: it has weights at all points where these are found by the true system.
pub(crate) fn on_centres(sizes: Sizes) -> Sizes {
    if sizes.n_points <= MOST_PRECONDITIONED { sizes } else { on_landmarks(sizes) }
}

/// The price of new values: four passes, and products with the matrix where the true system is solved.
pub(crate) fn landmark_fit_flops(n_points: usize) -> f64 {
    let (n, rank) = (n_points as f64, EXPECTED.min(n_points) as f64);
    let of_pairs = if n_points <= MOST_PRECONDITIONED { 1.5 * n * n * pair_flops(3, 0) } else { 0.0 };
    4.0 * n * rank * rank + of_pairs
}
