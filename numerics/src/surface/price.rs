//! Prices of surfaces, and of geometry at queries: quadrics, offset models and local regressions.
//!
//! Constants are times measured in dimensions 2 to 16, expressed in the flops of [`Price`].

use crate::machine::price::{Price, Sizes};
use crate::patches::MAX_LOCAL_DIMENSION;
use crate::patches::price::{choosing_flops, regression_flops};
use crate::points::duplicates::merging_flops;
use crate::points::quadric::{n_coefficients, n_quadric_neighbours};
use crate::points::sampling::{sampling_flops, sampling_price};
use crate::points::thinning::n_coarse;
use crate::regression::solver::price::FactorPrice;
use crate::regression::sums::price::pair_flops;

/// Number of queries at which one request may use the offset model. This is as much work as a factorization
/// of 8,500 points.
pub const MAX_OFFSETS: usize = 20_000;

/// Queries at which the offset model is used. Their number is known only afterwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Offsets {
    /// Queries where the gradient of the signature function vanishes. There are none on spheres, tori and the
    /// bunny. On a plane, all queries are of this kind.
    Rescues,
    /// Queries without a gradient, and queries where quadrics do not confirm curvatures.
    ///
    /// Their share, estimated by the time taken:
    /// - nearly none on spheres of 1,000 points and more,
    /// - about a tenth on a random torus of 3,000 points,
    /// - nearly all on a random torus of 1,000 points, on a sphere of 256, and on the bunny.
    Confirmations,
    /// At every query.
    Everywhere,
}

impl Offsets {
    /// Estimates the number of queries with an offset model, between the extremes: 2 in 100, a quarter, or
    /// all.
    fn n_asked(self, n_queries: usize) -> usize {
        let n_asked = match self {
            Self::Rescues => n_queries / 50,
            Self::Confirmations => n_queries / 4,
            Self::Everywhere => n_queries,
        };
        n_asked.min(MAX_OFFSETS)
    }
}

/// Quantities requested of a surface at queries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AskedOfSurface {
    pub offsets: Offsets,
    /// Whether curvatures are compared with a quadric at each query. Points of the surface get theirs with
    /// the surface.
    pub has_own_quadrics: bool,
    /// Whether local regressions estimate the errors of the geometry.
    pub has_deviations: bool,
}

/// The price of a surface by its signature function: the sums at the points, two searches and a quadric at
/// each.
///
/// Jets, normals and quadrics are kept. While they are made, they take half as much again, besides the lists
/// of neighbours.
pub(crate) fn signature_surface_price(n_points: usize, dimension: usize) -> Price {
    let n = n_points as f64;
    let at_points = n * pair_flops(dimension, 2) + quadric_flops(n_points, dimension);
    let flops = n * at_points + 2.0 * sampling_flops(n_points, dimension);
    // In three dimensions, 4.5 kB were measured when quadrics were small vectors
    // (tests/it/process/memory.rs). Now it is a bound.
    let own = Price { n_bytes: n_points.saturating_mul(1500 + 400 * dimension * dimension), flops };
    // The noise of a plane curve is estimated by local regressions, which orient it if it is noisy.
    if dimension == 2 { own.and(local_surface_price(n_points, dimension)) } else { own }
}

/// The price of a surface by local regressions, whose side is chosen by a coarse signature function.
pub(crate) fn local_surface_price(n_points: usize, dimension: usize) -> Price {
    let (n, coarse) = (n_points as f64, n_coarse(n_points));
    let of_coarse = FactorPrice::of(coarse, dimension).expected;
    // The ordered points, with their tree and spacings, are 22 + 16 d.
    let per_point = 729 + 16 * dimension * (dimension + 1);
    Price {
        n_bytes: n_points.saturating_mul(per_point).saturating_add(of_coarse.n_bytes),
        flops: choosing_flops(n_points, dimension)
            + n * regression_flops(dimension)
            + 60.0 * n * coarse as f64
            + of_coarse.flops
            + sampling_flops(n_points, dimension),
    }
}

/// The price of normals or curvatures of a signature function at queries.
pub(crate) fn geometry_price(asked: AskedOfSurface, sizes: Sizes) -> Price {
    let Sizes { n_points, n_queries, dimension } = sizes;
    let at_queries = n_queries.saturating_mul(numbers_at_query(dimension));
    let n_numbers = (4 * n_points).saturating_add(at_queries).saturating_add(deviation_numbers(asked, sizes));
    Price::of_numbers(n_numbers, geometry_flops(asked, sizes))
}

/// The price of the regions of a tile, each point of which may be a region of its own: its normal, its
/// neighbours with edges to them, and the sums over it.
pub fn regions_price(n_points: usize, dimension: usize) -> Price {
    let edges = 4 * (2 * dimension + 2);
    Price::of_numbers(n_points.saturating_mul(12 + 6 * dimension + edges), 1e5 * n_points as f64)
}

/// The price of choosing a coarse part of a cloud, of `count` points or as many as by default, with its
/// kernel. Its duplicates are merged.
pub fn coarse_price(n_points: usize, dimension: usize, count: Option<usize>) -> Price {
    let count = count.unwrap_or_else(|| n_coarse(n_points)).min(n_points);
    let halvings = (count as f64).log2().max(1.0) * n_points as f64;
    let of_coarse = sampling_price(count, dimension);
    let merging = Price::of_numbers(count.saturating_mul(2 * dimension + 8), merging_flops(count));
    let halving = Price::of_numbers(n_points, FLOPS_PER_HALVED * dimension as f64 * halvings);
    halving.and(merging).and(of_coarse)
}

/// Flops for a coordinate of a point each time that a cloud is halved: two searches for the farthest point,
/// a mean, and a selection. An estimate.
const FLOPS_PER_HALVED: f64 = 100.0;

/// The price of normals and curvatures by local regressions at queries.
pub(crate) fn local_geometry_price(sizes: Sizes) -> Price {
    let at_queries = sizes.n_queries.saturating_mul(numbers_at_query(sizes.dimension));
    Price::of_numbers(at_queries, regression_flops(sizes.dimension) * sizes.n_queries as f64)
}

/// Count of numbers held for the geometry at a query: two jets, normal, curvatures, directions, reports on
/// it, and its neighbours.
pub(crate) fn numbers_at_query(dimension: usize) -> usize {
    20 + 6 * dimension * dimension + 2 * n_quadric_neighbours(dimension)
}

/// Flops of the geometry of a signature function at queries.
pub(crate) fn geometry_flops(asked: AskedOfSurface, sizes: Sizes) -> f64 {
    let ([n, queries, d], Sizes { n_points, n_queries, dimension }) = (sizes.as_f64(), sizes);
    let quadrics = if asked.has_own_quadrics { quadric_flops(n_points, dimension) } else { 0.0 };
    let regressions = choosing_flops(n_points, dimension) + queries * regression_flops(dimension);
    // Without deviations, regressions run only where a normal is in doubt: nowhere on smooth surfaces,
    // everywhere on rough scans. Normals of small clouds are never in doubt.
    let may_doubt = n_points >= 4 * n_quadric_neighbours(dimension);
    let share = match (asked.has_deviations, asked.offsets) {
        (true, _) => 1.0,
        (false, Offsets::Rescues) if may_doubt => 0.02,
        (false, Offsets::Rescues | Offsets::Confirmations | Offsets::Everywhere) => 0.0,
    };
    n * queries * pair_flops(dimension, 2)
        + queries * (2e4 + 200.0 * d.powi(3) + quadrics)
        + asked.offsets.n_asked(n_queries) as f64 * offset_flops(n_points, dimension)
        + share * regressions
}

/// Largest number of threads with batches of regressions, as far as memory is counted.
const MAX_REGRESSING_THREADS: usize = 64;

/// Count of numbers held for deviations of the geometry, or 0 unless they are requested.
///
/// These are the numbers of the regressions, the normals and shapes that come with them, and the memory of
/// threads that make them.
pub(crate) fn deviation_numbers(asked: AskedOfSurface, sizes: Sizes) -> usize {
    let Sizes { n_queries, dimension, .. } = sizes;
    if !asked.has_deviations {
        return 0;
    }
    let at_queries = n_queries.saturating_mul(2 * dimension * dimension + 8 * dimension + 20);
    if dimension > MAX_LOCAL_DIMENSION {
        return at_queries;
    }
    let n_terms = n_coefficients(dimension);
    let count = 5 * n_terms;
    let n_threads = n_queries.div_ceil(8).min(MAX_REGRESSING_THREADS);
    at_queries.saturating_add(n_threads * 8 * count * (count + 4 * n_terms + 16))
}

/// Flops of a quadric through the nearest points, by orthogonal factorization, including the search for them.
fn quadric_flops(n_points: usize, dimension: usize) -> f64 {
    let n_columns = n_coefficients(dimension);
    let n_rows = n_quadric_neighbours(dimension).min(n_points);
    // There is no quadric with fewer points than coefficients.
    let factorization = if n_rows < n_columns { 0.0 } else { 12.5 * (n_rows * n_columns * n_columns) as f64 };
    1e5 + 500.0 * (n_columns as f64).powi(2) + factorization
}

/// Largest number of points in an offset model that counts. Larger models reach other sheets and are given
/// up.
const MAX_COUNTED: usize = 150;

/// Flops of the offset model at one query. Its layers have seven points for each coefficient.
fn offset_flops(n_points: usize, dimension: usize) -> f64 {
    let n_counted = (7 * n_coefficients(dimension)).min(n_points).min(MAX_COUNTED);
    1e6 + 2e3 * (n_counted as f64).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(has_deviations: bool) -> AskedOfSurface {
        AskedOfSurface { offsets: Offsets::Rescues, has_own_quadrics: false, has_deviations }
    }

    #[test]
    fn deviations_cost_regressions_where_there_are_some() {
        for d in 2..=16 {
            let sizes = Sizes { n_points: 300, n_queries: 300, dimension: d };
            let of = |has_deviations| geometry_flops(asked(has_deviations), sizes);
            assert_eq!(of(true) > of(false), d <= MAX_LOCAL_DIMENSION, "d = {d}");
        }
    }

    #[test]
    fn coarse_clouds_cost_what_their_points_do() {
        let flops = |count: usize| coarse_price(1_000_000, 3, Some(count)).flops;
        assert!(flops(1_000_000) > 5.0 * flops(1000));
        assert_eq!(coarse_price(1_000_000, 3, None).flops, flops(n_coarse(1_000_000)));
        assert_eq!(flops(usize::MAX), flops(1_000_000));
    }

    #[test]
    fn quadrics_cost_the_cube_of_their_coefficients_and_nothing_without_points_enough() {
        let ratio = quadric_flops(10_000, 16) / quadric_flops(10_000, 8);
        assert!((20.0..60.0).contains(&ratio), "{ratio}");
        assert!(quadric_flops(100, 16) < quadric_flops(136, 16) / 2.0);
    }
}
