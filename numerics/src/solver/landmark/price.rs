//! Prices of landmarks, whose number is known only when they are chosen.

use super::pivots::SAMPLE;
use super::rows::BLOCK;
use crate::machine::price::{Price, Sizes};

/// Landmarks that prices assume. A torus of radii 2 and ½ has 920 at the length scale 1 without noise, and
/// half as many with noise.
const EXPECTED: usize = 800;

/// Sizes of answers in which the landmarks stand for all points.
pub(crate) fn on_landmarks(sizes: Sizes) -> Sizes {
    Sizes { n_points: sizes.n_points.min(EXPECTED), ..sizes }
}

/// The price of choosing landmarks and of their normal equations: a pass over the points, and part of another
/// one, since some landmarks are completed.
pub(crate) fn landmark_price(n_points: usize, dimension: usize) -> Price {
    let rank = EXPECTED.min(n_points);
    let n_numbers = (SAMPLE.min(n_points) * rank)
        .saturating_add(4 * rank * rank + 3 * BLOCK * rank)
        .saturating_add(n_points.saturating_mul(8 + dimension));
    Price::of_numbers(n_numbers, 5.0 * n_points as f64 * (rank * rank) as f64)
}

/// The price of new values: two passes, and the residual of the true system.
pub(crate) fn landmark_fit_flops(n_points: usize) -> f64 {
    let rank = EXPECTED.min(n_points) as f64;
    4.0 * n_points as f64 * rank * rank
}
