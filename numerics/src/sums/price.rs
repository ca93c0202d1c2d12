//! Prices of sums over pairs.

/// Flops of a pair of point and query, up to derivatives of an order. Constants are times measured in dimensions
/// 2 to 16.
pub(crate) fn pair_flops(dimension: usize, order: usize) -> f64 {
    let d = dimension as f64;
    [40.0, 40.0 + d / 2.0, 40.0 + 0.4 * d * d][order.min(2)]
}
