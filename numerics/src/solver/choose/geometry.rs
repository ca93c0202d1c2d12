//! Prices of geometry at queries: quadrics, offset models and local regressions, each by the dimension.
//!
//! Constants are times measured in dimensions 2 to 16, in flops of the unit that [`super::Price`] has: a sum
//! over pairs of a kernel without derivatives takes 40 for each.

use super::MAX_LOCAL_DIMENSION;
use crate::points::quadric::{n_coefficients, n_quadric_neighbours};

/// Queries at which one request may ask the offset model: as much work as a factorization of 8,500 points.
pub const MAX_OFFSETS: usize = 20_000;

/// At how many queries the offset model is asked, which is known only afterwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Offsets {
    /// Where the gradient of the signature function vanishes: nowhere on spheres, tori and the bunny,
    /// everywhere on a plane.
    Rescues,
    /// Where quadrics do not confirm curvatures as well. By the time that it takes: nearly nowhere on spheres
    /// of 1,000 points and more, at some tenth of a random torus of 3,000, nearly everywhere on one of 1,000,
    /// on a sphere of 256, and on the bunny.
    Confirmations,
    /// At every query.
    Everywhere,
}

impl Offsets {
    /// A number between the extremes: 2 in 100 queries, a quarter, all.
    fn n_asked(self, n_queries: usize) -> usize {
        let n_asked = match self {
            Self::Rescues => n_queries / 50,
            Self::Confirmations => n_queries / 4,
            Self::Everywhere => n_queries,
        };
        n_asked.min(MAX_OFFSETS)
    }
}

/// What is asked of a surface at queries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AskedOfSurface {
    pub offsets: Offsets,
    /// Whether curvatures are held against a quadric of each query: those at the points of the surface are
    /// made with it.
    pub has_own_quadrics: bool,
    /// Whether local regressions say how far off the geometry is.
    pub has_deviations: bool,
}

/// Flops of a pair of point and query, up to derivatives of an order.
pub(super) fn pair_flops(dimension: usize, order: usize) -> f64 {
    let d = dimension as f64;
    [40.0, 40.0 + d / 2.0, 40.0 + 0.4 * d * d][order.min(2)]
}

/// Flops of a quadric through the nearest points, by orthogonal factorization, with the search for them.
pub(super) fn quadric_flops(n_points: usize, dimension: usize) -> f64 {
    let n_columns = n_coefficients(dimension);
    let n_rows = n_quadric_neighbours(dimension).min(n_points);
    // Fewer points than coefficients have none.
    let factorization = if n_rows < n_columns { 0.0 } else { 12.5 * (n_rows * n_columns * n_columns) as f64 };
    1e5 + 500.0 * (n_columns as f64).powi(2) + factorization
}

/// Points of an offset model at most that count: larger ones reach other sheets, and are given up.
const MAX_COUNTED: usize = 150;

/// Flops of the offset model at one query: layers of seven points a coefficient.
fn offset_flops(n_points: usize, dimension: usize) -> f64 {
    let n_counted = (7 * n_coefficients(dimension)).min(n_points).min(MAX_COUNTED);
    1e6 + 2e3 * (n_counted as f64).powi(2)
}

/// Flops of a local regression at one query by all models of the mixture. None is made beyond the dimensions
/// that have one.
pub(super) fn regression_flops(dimension: usize) -> f64 {
    match dimension {
        ..=2 => 2e5,
        3 => 3e5,
        MAX_LOCAL_DIMENSION => 3e6,
        _ => 0.0,
    }
}

/// Regressions that choosing neighbourhoods and hyperparameters takes, of large clouds and for each point of
/// small ones.
const REGRESSIONS_TO_CHOOSE: usize = 500;
const REGRESSIONS_PER_POINT: usize = 5;

/// Flops of choosing them.
pub(super) fn choosing_flops(n_points: usize, dimension: usize) -> f64 {
    let n_regressions = n_points.saturating_mul(REGRESSIONS_PER_POINT).min(REGRESSIONS_TO_CHOOSE);
    n_regressions as f64 * regression_flops(dimension)
}

/// Flops of the geometry of a signature function at m queries.
pub(super) fn geometry_flops(asked: AskedOfSurface, n_points: usize, m: usize, dimension: usize) -> f64 {
    let (n, queries, d) = (n_points as f64, m as f64, dimension as f64);
    let quadrics = if asked.has_own_quadrics { quadric_flops(n_points, dimension) } else { 0.0 };
    let regressions = choosing_flops(n_points, dimension) + queries * regression_flops(dimension);
    // Without deviations they are asked for where a normal is in doubt: nowhere on smooth surfaces, everywhere on
    // rough scans. Small clouds are not doubted.
    let may_doubt = n_points >= 4 * n_quadric_neighbours(dimension);
    let share = match (asked.has_deviations, asked.offsets) {
        (true, _) => 1.0,
        (false, Offsets::Rescues) if may_doubt => 0.02,
        (false, Offsets::Rescues | Offsets::Confirmations | Offsets::Everywhere) => 0.0,
    };
    n * queries * pair_flops(dimension, 2)
        + queries * (2e4 + 200.0 * d.powi(3) + quadrics)
        + asked.offsets.n_asked(m) as f64 * offset_flops(n_points, dimension)
        + share * regressions
}

/// Numbers of the deviations of geometry at m queries: those of the regressions, the normals and shapes that
/// come with them, and the room of threads that make them.
pub(super) fn deviation_numbers(m: usize, dimension: usize) -> usize {
    let at_queries = m.saturating_mul(2 * dimension * dimension + 8 * dimension + 20);
    if dimension > MAX_LOCAL_DIMENSION {
        return at_queries;
    }
    let n_terms = n_coefficients(dimension);
    let count = 5 * n_terms;
    let n_threads = m.div_ceil(8).min(super::MAX_KRIGING_THREADS);
    at_queries.saturating_add(n_threads * 8 * count * (count + 4 * n_terms + 16))
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
            let of = |has_deviations| geometry_flops(asked(has_deviations), 300, 300, d);
            assert_eq!(of(true) > of(false), d <= MAX_LOCAL_DIMENSION, "d = {d}");
        }
    }

    #[test]
    fn quadrics_cost_the_cube_of_their_coefficients_and_nothing_without_points_enough() {
        let ratio = quadric_flops(10_000, 16) / quadric_flops(10_000, 8);
        assert!((20.0..60.0).contains(&ratio), "{ratio}");
        assert!(quadric_flops(100, 16) < quadric_flops(136, 16) / 2.0);
    }
}
