//! What learning takes, known before it is begun.

use super::order::{DEEP_GROUPS, GIVEN, GIVEN_DEEP, MAX_GROUPS, MAX_SAMPLE, MAX_TOGETHER, RESPONSES};
use super::values::MAX_LISTS;
use crate::solver::choose::{Price, sampling_bytes};

/// Cells of the grid that are looked at, mostly: from nothing, from what was found on a sample, and by deep
/// groups.
const CELLS: f64 = 70.0;
const CELLS_FROM_SAMPLE: f64 = 40.0;
const CELLS_OF_DEEP: f64 = 4.0;

/// Flops for the order of a point.
const FLOPS_OF_ORDER: f64 = 500.0;

/// Of [`super::learn`] for so many lists of values at n points of d dimensions, beside the sampling of the cloud.
///
/// Bytes are those of the order (the points that come earlier with their tree, and indices), of the groups
/// with what the mean and the lists of values leave of them, and of the matrices of groups side by side.
pub fn learning_price(n_points: usize, dimension: usize, n_lists: usize) -> Price {
    let together = |n: usize| (n * n) as f64 * (n as f64 / 3.0 + 20.0);
    let square = |n: usize| n.saturating_mul(n);
    let (given, deep) = (GIVEN + RESPONSES, GIVEN_DEEP + RESPONSES);
    // Position twice, variance of the noise, functions of a linear mean and lists, these once more whitened and
    // once more in one piece.
    let of_member =
        dimension.saturating_mul(2).saturating_add(1 + 3 * (dimension + 1 + n_lists.min(MAX_LISTS)));
    if n_points <= MAX_TOGETHER {
        let n_numbers = square(n_points) + n_points.saturating_mul(of_member);
        let flops = CELLS * together(n_points) + FLOPS_OF_ORDER * n_points as f64;
        return Price { n_bytes: n_numbers.saturating_mul(size_of::<f64>()), flops };
    }
    let n_groups = n_points.div_ceil(RESPONSES).min(2 * MAX_GROUPS);
    let n_members = MAX_SAMPLE + n_groups * given + DEEP_GROUPS * deep;
    let n_numbers = n_members.saturating_mul(of_member) + DEEP_GROUPS * square(deep);
    // Earlier points are copied for their tree; five lists of indices.
    let of_order = sampling_bytes(n_points, dimension)
        .saturating_add(n_points.saturating_mul((dimension + 5) * size_of::<f64>()));
    let of_groups = n_groups as f64 * together(given) + together(MAX_SAMPLE);
    let flops = CELLS * together(MAX_SAMPLE)
        + CELLS_FROM_SAMPLE * of_groups
        + CELLS_OF_DEEP * DEEP_GROUPS as f64 * together(deep)
        + FLOPS_OF_ORDER * n_points as f64;
    Price { n_bytes: n_numbers.saturating_mul(size_of::<f64>()).saturating_add(of_order), flops }
}
