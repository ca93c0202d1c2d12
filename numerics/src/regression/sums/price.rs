//! Prices of sums over pairs.

/// Flops of one pair of point and query, with derivatives up to `order`. Constants are times measured in
/// dimensions 2 to 16.
pub(crate) fn pair_flops(dimension: usize, order: usize) -> f64 {
    let d = dimension as f64;
    [40.0, 40.0 + d / 2.0, 40.0 + 0.4 * d * d][order.min(2)]
}
