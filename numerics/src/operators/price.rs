//! Prices of operators: applied, as matrices, and by stencils.

use crate::machine::price::{Price, Sizes};
use crate::patches::price::regression_flops;
use crate::points::monomials::n_stencil_nodes;
use crate::points::sampling::sampling_flops;
use crate::regression::solver::price::numbers_at_point;
use crate::regression::sums::price::pair_flops;
use crate::surface::price::{AskedOfSurface, deviation_numbers, geometry_flops, numbers_at_query};

/// The price of an operator on a surface of `n_surface_points` points, applied to a function through values.
pub(crate) fn applied_price(n_surface_points: usize, surface: AskedOfSurface, sizes: Sizes) -> Price {
    let ([n, m, _], Sizes { n_points, n_queries, dimension }) = (sizes.as_f64(), sizes);
    let of_surface = Sizes { n_points: n_surface_points, ..sizes };
    let sums = n * (40.0 * n + pair_flops(dimension, 2) * m);
    let at_points = n_points.saturating_add(n_surface_points).saturating_mul(numbers_at_point(dimension));
    let at_queries = n_queries.saturating_mul(numbers_at_query(dimension));
    let n_numbers = at_points.saturating_add(at_queries).saturating_add(sizes.jets());
    let of_deviations = deviation_numbers(surface, of_surface);
    Price::of_numbers(n_numbers.saturating_add(of_deviations), geometry_flops(surface, of_surface) + sums)
}

/// The price of an operator as a dense matrix of `n_rows` rows.
pub fn matrix_price(n_rows: usize, n_surface_points: usize, surface: AskedOfSurface, sizes: Sizes) -> Price {
    let ([n, _, _], Sizes { n_points, n_queries, dimension }) = (sizes.as_f64(), sizes);
    let geometry = geometry_flops(surface, Sizes { n_points: n_surface_points, ..sizes });
    let at_points = n_points.saturating_mul(numbers_at_point(dimension));
    let at_queries = n_queries.saturating_mul(numbers_at_query(dimension));
    Price::of_numbers(at_points.saturating_add(at_queries), 2.0 * n * n * n_rows as f64 + geometry)
}

/// Largest number of entries in a row of a sparse operator.
pub fn n_entries_per_row(dimension: usize) -> usize {
    n_stencil_nodes(dimension.max(2))
}

/// Flops of the weights of a stencil on a surface in space, found by elimination in a small system.
const FLOPS_PER_STENCIL: f64 = 3e5;

/// The price of an operator by stencils of the nearest nodes, on local geometry or another.
pub fn stencils_price(sizes: Sizes) -> Price {
    let ([_, m, _], Sizes { n_points, n_queries, dimension }) = (sizes.as_f64(), sizes);
    let at_queries = n_queries.saturating_mul(numbers_at_query(dimension));
    // An entry has a column, its place among the ordered ones and a number per component. Assembly holds them
    // once more.
    let n_entries = 4 * (2 + dimension) * n_entries_per_row(dimension);
    // The system of a stencil has as many unknowns as there are nodes.
    let of_stencil =
        FLOPS_PER_STENCIL * (n_entries_per_row(dimension) as f64 / n_entries_per_row(3) as f64).powi(3);
    let flops = (regression_flops(dimension) + of_stencil) * m + sampling_flops(n_points, dimension);
    Price::of_numbers(at_queries.saturating_add(n_queries.saturating_mul(n_entries)), flops)
}
