//! Prices of factorizations and of solves with them.

use super::Solver;
use crate::machine::price::Price;

/// Price of factorizing n points densely: in nearly all cases, and at most.
pub(crate) struct FactorPrice {
    pub expected: Price,
    pub at_most: Price,
}

impl FactorPrice {
    /// Cholesky takes n³/3 flops. Where it fails, the fallback takes up to 0.54 n³ more, at rank 2n/3.
    pub(crate) fn of(n_points: usize, dimension: usize) -> Self {
        let n = n_points as f64;
        let bytes = |n_numbers: Option<usize>| {
            // Besides the matrix, O(n) numbers: the points in blocks, and vectors of the condition estimate.
            let beside = n_points.checked_mul(dimension.saturating_add(10));
            let n_numbers = n_numbers.zip(beside).and_then(|(matrix, beside)| matrix.checked_add(beside));
            n_numbers.and_then(|n_numbers| n_numbers.checked_mul(size_of::<f64>())).unwrap_or(usize::MAX)
        };
        Self {
            expected: Price { n_bytes: bytes(Solver::n_numbers_needed(n_points)), flops: n.powi(3) / 3.0 },
            at_most: Price { n_bytes: bytes(Solver::n_numbers_needed_at_most(n_points)), flops: n.powi(3) },
        }
    }
}

/// Count of numbers that a solve for new values holds for each point.
///
/// These are the point, its value, two sets of weights with their sums and residuals during refinement, and a
/// correction.
pub(crate) fn numbers_at_point(dimension: usize) -> usize {
    10 + dimension
}

/// Flops for each entry of a whitened column. Half of a triangle is read for it. Large triangles are read at
/// the speed of a factorization.
pub(crate) fn whitening_flops(n: f64) -> f64 {
    0.75 * n + 750.0
}
