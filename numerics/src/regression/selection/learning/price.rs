//! Cost of learning, estimated before it begins.

use super::columns::{self, is_table};
use super::order::{DEEP_GROUPS, GIVEN, GIVEN_DEEP, MAX_GROUPS, MAX_SAMPLE, MAX_TOGETHER, RESPONSES};
use super::values::MAX_LISTS;
use crate::machine::price::Price;
use crate::points::cloud::Cloud;
use crate::points::sampling::sampling_price;
use crate::regression::selection::criterion::Criterion;
use crate::regression::selection::price::{CloudSize, SearchSize, selection_price};

/// Number of cells of the grid that a search from nothing usually scores. [`CELLS_FROM_SAMPLE`] is for a
/// search that begins at the result of a sample, [`CELLS_OF_DEEP`] for deep groups.
const CELLS: f64 = 70.0;
const CELLS_FROM_SAMPLE: f64 = 40.0;
const CELLS_OF_DEEP: f64 = 4.0;

/// Flops to order one point.
const FLOPS_OF_ORDER: f64 = 500.0;

/// Returns the cost of [`super::learn`] for `n_lists` lists of values at the points of a cloud, without the
/// sampling of the cloud.
///
/// For a table whose columns may get length scales of their own, kernels are compared up to three times, and
/// a descent on a sample of the rows finds the scales.
pub fn learning_price(cloud: &Cloud, n_lists: usize) -> Price {
    let (n, d) = (cloud.n_points(), cloud.dimension());
    let alike = comparison_price(n, d, n_lists);
    if !is_table(cloud) {
        return alike;
    }
    let sample = CloudSize { n_points: n.min(columns::MAX_SAMPLE), dimension: d };
    let n_evaluations = columns::MAX_EVALUATIONS;
    let size = SearchSize { n_free: d + 2, n_evaluations, n_families: 1, n_starts: 1, n_threads: 1 };
    let of_descent = selection_price(sample, Criterion::MarginalLikelihood, size);
    // The points in units of their scales are another cloud, with a tree of its own.
    let mut of_scales = alike.and(sampling_price(n, d));
    of_scales.n_bytes = of_scales.n_bytes.saturating_add(n.saturating_mul(d * size_of::<f64>()));
    alike.and(of_descent).and(of_scales).and(of_scales)
}

/// Returns the cost of one comparison of kernels on values at n points of d dimensions.
///
/// Bytes are those of the order, of the groups, and of the matrices that are factorized side by side. The
/// order holds the earlier points with their tree, and indices. The groups hold what the mean and the lists
/// of values leave of them.
fn comparison_price(n_points: usize, dimension: usize, n_lists: usize) -> Price {
    let together = |n: usize| (n * n) as f64 * (n as f64 / 3.0 + 20.0);
    let square = |n: usize| n.saturating_mul(n);
    let (given, deep) = (GIVEN + RESPONSES, GIVEN_DEEP + RESPONSES);
    // Numbers of a member: its position twice and the variance of its noise. The functions of a linear mean
    // and the lists count three times: as given, whitened, and once more in one piece.
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
    // Earlier points are copied for their tree, and there are five lists of indices.
    let of_order = sampling_price(n_points, dimension)
        .n_bytes
        .saturating_add(n_points.saturating_mul((dimension + 5) * size_of::<f64>()));
    let of_groups = n_groups as f64 * together(given) + together(MAX_SAMPLE);
    let flops = CELLS * together(MAX_SAMPLE)
        + CELLS_FROM_SAMPLE * of_groups
        + CELLS_OF_DEEP * DEEP_GROUPS as f64 * together(deep)
        + FLOPS_OF_ORDER * n_points as f64;
    Price { n_bytes: n_numbers.saturating_mul(size_of::<f64>()).saturating_add(of_order), flops }
}
