//! Cost of model selection, estimated before it begins.

use super::alpha_path::{ALPHAS_AT_ONCE, is_decomposed};
use super::criterion::Criterion;
use super::search::{MAX_FROM_EVERY_START, MAX_SIDE_BY_SIDE_POINTS, SAMPLE};
use crate::machine::price::Price;

/// Returns the number of evaluations that a descent over `n_free` numbers usually takes. About 50 were
/// counted for 6 numbers and 70 to 110 for 12 (`bench/peers/model_selection.py`).
pub fn expected_evaluations(n_free: usize) -> usize {
    if n_free == 0 { 1 } else { 40 + 6 * n_free }
}

/// Points and coordinates of a cloud.
#[derive(Debug, Clone, Copy)]
pub struct CloudSize {
    pub n_points: usize,
    pub dimension: usize,
}

/// Extent of a search.
#[derive(Debug, Clone, Copy)]
pub struct SearchSize {
    /// Free numbers of each descent.
    pub n_free: usize,
    /// Evaluations of each descent.
    pub n_evaluations: usize,
    pub n_families: usize,
    /// Starts of each family.
    pub n_starts: usize,
    pub n_threads: usize,
}

/// Returns the cost of a search.
///
/// With all slopes, an evaluation takes n³ flops for the likelihood and 2n³ for other criteria. Without
/// slopes it takes a third of that. A pass over the pairs is added.
///
/// Descents of up to 1,024 points run side by side on the threads, each with memory of its own. With more
/// than 768 points, one descent of each family is on all of them, after one evaluation of every start, and
/// the others are on samples.
pub fn selection_price(cloud: CloudSize, criterion: Criterion, search: SearchSize) -> Price {
    if cloud.n_points <= MAX_FROM_EVERY_START || search.n_starts <= 1 {
        return descents_price(cloud, criterion, search);
    }
    let SearchSize { n_evaluations, n_starts, .. } = search;
    let on_sample = descents_price(CloudSize { n_points: SAMPLE, ..cloud }, criterion, search);
    let on_all =
        SearchSize { n_evaluations: n_evaluations.saturating_add(n_starts + 1), n_starts: 1, ..search };
    on_sample.and(descents_price(cloud, criterion, on_all))
}

/// Returns the cost of descents from every start.
fn descents_price(cloud: CloudSize, criterion: Criterion, search: SearchSize) -> Price {
    let CloudSize { n_points, dimension } = cloud;
    let SearchSize { n_free, n_evaluations, n_families, n_starts, n_threads } = search;
    let n_descents = n_families.saturating_mul(n_starts);
    let (n, d) = (n_points as f64, dimension as f64);
    let cubes = match criterion {
        Criterion::MarginalLikelihood if n_free == 0 => 1.0 / 3.0,
        Criterion::MarginalLikelihood => 1.0,
        _ if n_free == 0 => 2.0 / 3.0,
        Criterion::LeaveOneOut | Criterion::GeneralizedCrossValidation => 2.0,
    };
    let evaluation = n * n * (cubes * n + 40.0 + 2.0 * d + 4.0 * n_free as f64);
    let side_by_side = if n_points <= MAX_SIDE_BY_SIDE_POINTS { n_descents.min(n_threads).max(1) } else { 1 };
    let beside = n_points.saturating_mul(4 * dimension + 20);
    let n_numbers = n_points.saturating_mul(n_points).saturating_mul(3).saturating_add(beside);
    Price {
        n_bytes: n_numbers.saturating_mul(side_by_side).saturating_mul(size_of::<f64>()),
        flops: n_descents as f64 * n_evaluations as f64 * evaluation,
    }
}

/// Returns the cost of a path over `n_alphas` values of α. Either it takes one eigendecomposition, with
/// matrix products where the score needs the diagonal of the inverse, or a factorization for each α.
pub fn alpha_path_price(
    cloud: CloudSize,
    criterion: Criterion,
    n_functions: usize,
    n_alphas: usize,
) -> Price {
    let CloudSize { n_points, dimension } = cloud;
    if !is_decomposed(n_points, n_alphas) {
        let one_by_one =
            SearchSize { n_free: 0, n_evaluations: n_alphas, n_families: 1, n_starts: 1, n_threads: 1 };
        return selection_price(cloud, criterion, one_by_one);
    }
    let (n, d, m, p) = (n_points as f64, dimension as f64, n_alphas as f64, n_functions as f64);
    let each = match criterion {
        Criterion::MarginalLikelihood => n * (10.0 + 4.0 * (p + 1.0) * (p + 1.0)),
        Criterion::LeaveOneOut => 4.0 * n * n,
        Criterion::GeneralizedCrossValidation => 10.0 * n,
    };
    let n_matrices = 5;
    let beside = n_points.saturating_mul(4 * dimension + 4 * n_functions + 20);
    let n_numbers = n_points.saturating_mul(n_points).saturating_mul(n_matrices).saturating_add(beside);
    let at_once = n_points.saturating_mul(4 * ALPHAS_AT_ONCE.min(n_alphas));
    Price {
        n_bytes: n_numbers.saturating_add(at_once).saturating_mul(size_of::<f64>()),
        flops: 9.0 * n.powi(3) + n * n * (20.0 + d + 4.0 * p) + m * each,
    }
}

/// Returns the cost of predicting every value from all others, with an existing solver or a factorization of
/// its own.
pub fn leave_one_out_price(n_points: usize, n_functions: usize) -> Price {
    let n = n_points as f64;
    let n_numbers = n_points.saturating_mul(3 * n_points.min(512) + 3 * n_functions + 20);
    let with_factor = n_points.saturating_mul(2 * n_points);
    Price { n_bytes: n_numbers.max(with_factor).saturating_mul(size_of::<f64>()), flops: n.powi(3) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_of_anything_never_costs_less() {
        let criteria =
            [Criterion::MarginalLikelihood, Criterion::LeaveOneOut, Criterion::GeneralizedCrossValidation];
        let search =
            |n_evaluations| SearchSize { n_free: 4, n_evaluations, n_families: 2, n_starts: 3, n_threads: 2 };
        for criterion in criteria {
            for (few, many) in [(10, 100), (100, 3000), (3000, 1 << 40)] {
                let cloud = |n_points| CloudSize { n_points, dimension: 3 };
                let price = |n: usize| selection_price(cloud(n), criterion, search(n));
                let path = |n: usize| alpha_path_price(cloud(n), criterion, 4, n);
                for (small, large) in [(price(few), price(many)), (path(few), path(many))] {
                    assert!(small.flops < large.flops && small.n_bytes < large.n_bytes);
                }
            }
        }
        let huge = CloudSize { n_points: 1 << 40, dimension: 3 };
        assert_eq!(selection_price(huge, Criterion::LeaveOneOut, search(1)).n_bytes, usize::MAX);
    }
}
