//! Which solver serves what is asked, and what that costs: the one place that knows bytes and flops.
//!
//! Pure: sizes in, prices out. The routes say what they want, and whoever admits, queues or refuses asks here. Flops are those
//! of a large factorization, so that all prices compare: a sum over pairs takes longer for each of its operations.

mod geometry;

pub use geometry::{AskedOfSurface, MAX_OFFSETS, Offsets};
use geometry::{
    choosing_flops, deviation_numbers, geometry_flops, pair_flops, quadric_flops, regression_flops,
};

use super::dense::Dense;
use crate::error::SolverKind;
use crate::points::monomials::n_stencil_nodes;
use crate::points::noise::{DEGREES_OF_FREEDOM, MAX_SITES};
use crate::points::quadric::{n_coefficients, n_quadric_neighbours};
use crate::points::thinning::n_coarse;
use crate::sums::many::QUERIES_PER_BLOCK;

/// Why a solver was chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// It is exact, and its matrix fits into memory.
    Fits,
    /// Nothing smaller is there: it serves if it is there already, and else is refused for its memory.
    NothingSmaller,
    /// It takes no matrix.
    Linear,
}

/// Bytes and flops.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Price {
    pub n_bytes: usize,
    pub flops: f64,
}

/// What making a system and its surface ready takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Choice {
    pub solver: SolverKind,
    pub reason: Reason,
    /// Of the solver, as nearly always; `usize::MAX` bytes for what cannot be counted.
    pub expected: Price,
    /// Of the solver at most.
    pub at_most: Price,
    /// Of the surface with its quadrics and normals.
    pub surface: Price,
}

/// Chooses the solver of a system of n points in d dimensions, with so many bytes of memory.
pub fn choose(n_points: usize, dimension: usize, memory: usize) -> Choice {
    let n = n_points as f64;
    let bytes = |n_numbers: Option<usize>| {
        // O(n) numbers beside the matrix: the points in blocks, and vectors of the estimate of the condition.
        let beside = n_points.checked_mul(dimension.saturating_add(10));
        let n_numbers = n_numbers.zip(beside).and_then(|(matrix, beside)| matrix.checked_add(beside));
        n_numbers.and_then(|n_numbers| n_numbers.checked_mul(size_of::<f64>())).unwrap_or(usize::MAX)
    };
    // n³/3 for Cholesky, and where that fails up to 0.54 n³ more for the fallback, at rank 2n/3.
    let expected = Price { n_bytes: bytes(Dense::n_numbers_needed(n_points)), flops: n.powi(3) / 3.0 };
    let at_most = Price { n_bytes: bytes(Dense::n_numbers_needed_at_most(n_points)), flops: n.powi(3) };
    let reason = if expected.n_bytes <= memory { Reason::Fits } else { Reason::NothingSmaller };
    let surface = surface_price(n_points, dimension);
    Choice { solver: SolverKind::Dense, reason, expected, at_most, surface }
}

/// Points from which `auto` regresses a surface locally where nothing else is given: the factorization alone takes more than a second.
pub const LOCAL_FROM: usize = 5_000;

/// The greatest dimension of local regressions; beyond it neighbourhoods say too little.
pub const MAX_LOCAL_DIMENSION: usize = 4;

/// Why `auto` chose local regressions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AutoLocal {
    /// The cloud has more points than are factorized.
    BeyondDense,
    /// Their work is linear in the points, of which there are many.
    ManyPoints,
    /// Standard deviations are asked for, which are theirs.
    Deviations,
}

/// Whether a surface of which nothing is given but its points is better regressed locally.
pub fn prefers_local(
    n_points: usize,
    dimension: usize,
    max_dense_points: usize,
    has_deviations: bool,
) -> Option<AutoLocal> {
    match dimension {
        2..=MAX_LOCAL_DIMENSION if n_points > max_dense_points => Some(AutoLocal::BeyondDense),
        2..=MAX_LOCAL_DIMENSION if has_deviations => Some(AutoLocal::Deviations),
        2..=MAX_LOCAL_DIMENSION if n_points >= LOCAL_FROM => Some(AutoLocal::ManyPoints),
        _ => None,
    }
}

/// Entries of a row of a sparse operator, at most.
pub fn n_entries_per_row(dimension: usize) -> usize {
    n_stencil_nodes(dimension.max(2))
}

/// Flops of the weights of a stencil: a small system by elimination.
const FLOPS_PER_STENCIL: f64 = 3e5;

/// Local regressions of n points, with the side chosen by a coarse signature function.
pub fn choose_local(n_points: usize, dimension: usize) -> Choice {
    let (n, coarse) = (n_points as f64, n_coarse(n_points));
    let of_coarse = choose(coarse, dimension, usize::MAX);
    let per_point = 700 + 16 * dimension * dimension;
    let surface = Price {
        n_bytes: n_points.saturating_mul(per_point).saturating_add(of_coarse.expected.n_bytes),
        flops: choosing_flops(n_points, dimension)
            + n * regression_flops(dimension)
            + 60.0 * n * coarse as f64
            + of_coarse.expected.flops
            + sampling_flops(n_points, dimension),
    };
    // A trifle, but something: what takes nothing is not missing.
    let nothing = Price { n_bytes: 1 << 10, flops: 0.0 };
    Choice { solver: SolverKind::Local, reason: Reason::Linear, expected: nothing, at_most: nothing, surface }
}

/// Kriging around queries: a check of the system, and how its cloud is sampled, which is looked at here only where its duplicates are
/// merged or the kernel stretches it.
pub fn choose_moving(n_points: usize, dimension: usize, is_merged: bool, is_stretched: bool) -> Choice {
    let numbers = n_points.saturating_mul((dimension + 4) * size_of::<f64>());
    let looking = if is_merged || is_stretched { sampling_flops(n_points, dimension) } else { 0.0 };
    let sampled = sampling_bytes(n_points, dimension).saturating_add(numbers);
    let price = Price {
        n_bytes: sampled.saturating_mul(1 + usize::from(is_stretched)).saturating_add(1 << 10),
        // Coinciding points are found by sorting.
        flops: 100.0 * n_points as f64 + looking,
    };
    let surface = Price::default();
    Choice { solver: SolverKind::Local, reason: Reason::Linear, expected: price, at_most: price, surface }
}

/// Points of a moving neighbourhood. For Matérn 3/2 in three dimensions with little noise, means are within 3 to 5 % of the deviation of
/// the dense posterior, with 64 within 9 to 13 % (docs/scale.md).
pub const NEIGHBOURS: usize = 128;

/// Flops of kriging at one query, and of the search for its neighbours.
const FLOPS_PER_KRIGING: f64 = 1e6;

/// Queries that are solved side by side, and threads that do so at most as far as memory is counted.
const KRIGED_AT_ONCE: usize = 8;
const MAX_KRIGING_THREADS: usize = 64;

/// Numbers in the room of a thread: a triangle for each query, and some rows.
fn numbers_to_krige(dimension: usize, n_deviations: usize) -> usize {
    KRIGED_AT_ONCE * NEIGHBOURS * (NEIGHBOURS / 2 + 12 + dimension + n_deviations)
}

/// The sums at the points, two searches and a quadric at each. Jets, normals and quadrics are kept; while they are made, half as
/// much again is there beside the lists of neighbours.
fn surface_price(n_points: usize, dimension: usize) -> Price {
    let n = n_points as f64;
    let at_points = n * pair_flops(dimension, 2) + quadric_flops(n_points, dimension);
    let flops = n * at_points + 2.0 * sampling_flops(n_points, dimension);
    // 4.5 kB in three dimensions were measured when quadrics were small vectors (tests/it/memory.rs); now it is a bound.
    Price { n_bytes: n_points.saturating_mul(1500 + 400 * dimension * dimension), flops }
}

/// Flops of [`crate::points::sampling::Sampling::of`]: every search visits a few leaves, in many dimensions most of the
/// cloud.
pub fn sampling_flops(n_points: usize, dimension: usize) -> f64 {
    let n = n_points as f64;
    let visited = n.min(60.0 * 2f64.powi(dimension.min(60) as i32));
    // Distance, comparison and descent.
    n * visited * (3.0 * dimension as f64 + 10.0)
}

/// Bytes that it takes at its peak: the tree with the points in its order, and four numbers a point.
pub fn sampling_bytes(n_points: usize, dimension: usize) -> usize {
    n_points.saturating_mul((dimension + 6) * size_of::<f64>())
}

/// Flops of [`crate::points::noise::estimate_noise`]: searches, and two quadrics each by orthogonal factorization.
pub fn noise_flops(n_points: usize, dimension: usize) -> f64 {
    let (n, sites) = (n_points as f64, n_points.min(2 * MAX_SITES) as f64);
    let visited = n.min(200.0 * 2f64.powi(dimension.min(60) as i32));
    let (n_columns, d) = (n_coefficients(dimension.max(2)) as f64, dimension as f64);
    let n_rows = 2.0 * (n_columns + DEGREES_OF_FREEDOM as f64);
    sites * (visited * (3.0 * d + 10.0) + 6.0 * n_rows * n_columns * n_columns)
}

/// Queries of which variances are held at once.
pub const VARIANCES_AT_ONCE: usize = 512;

/// What is asked of a prepared fit, beside its solver and surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Asked {
    /// A function through new values, with derivatives up to an order.
    Function { order: usize },
    /// The same as a Gaussian process.
    Posterior { variances: bool, covariance: bool },
    /// Values, derivatives and variances from the points nearest to each query, and so many deviations at each.
    Moving { n_deviations: usize },
    /// Normals or curvatures.
    Geometry(AskedOfSurface),
    /// Normals and curvatures by local regressions.
    LocalGeometry,
    /// An operator by stencils of the nearest nodes, on local geometry or another.
    Stencils,
    /// An operator on the surface of `n_surface_points`, applied to values.
    Operator { n_surface_points: usize, surface: AskedOfSurface },
    /// An operator as a matrix of so many rows.
    OperatorMatrix { n_surface_points: usize, n_rows: usize, surface: AskedOfSurface },
}

/// What answering m queries takes, beside the numbers of the answer.
pub fn work_price(asked: Asked, n_points: usize, n_queries: usize, dimension: usize) -> Price {
    let (n, m, d) = (n_points as f64, n_queries as f64, dimension as f64);
    let at_points = n_points.saturating_mul(numbers_at_point(dimension));
    let at_queries = n_queries.saturating_mul(numbers_at_query(dimension));
    let jets = n_queries.saturating_mul(1 + dimension + dimension * dimension);
    let of_deviations =
        |of: AskedOfSurface| if of.has_deviations { deviation_numbers(n_queries, dimension) } else { 0 };
    let (flops, n_numbers) = match asked {
        Asked::Function { order } => {
            (n * (40.0 * n + pair_flops(dimension, order) * m), at_points.saturating_add(jets))
        }
        Asked::Posterior { variances, covariance } => {
            let whitened = match (covariance, variances) {
                (true, _) => n_queries,
                (false, true) => n_queries.min(VARIANCES_AT_ONCE),
                (false, false) => 0,
            };
            let flops = 40.0 * n * (n + m)
                + if whitened > 0 { n * m * whitening_flops(n) } else { 0.0 }
                + if covariance { n * m * m } else { 0.0 };
            let n_numbers = whitened.saturating_add(numbers_at_point(dimension)).saturating_mul(n_points);
            (flops, n_numbers.saturating_add(n_queries.saturating_mul(2 + dimension)))
        }
        Asked::Moving { n_deviations } => {
            let n_threads = n_queries.div_ceil(KRIGED_AT_ONCE).min(MAX_KRIGING_THREADS);
            let rooms = n_threads * numbers_to_krige(dimension, n_deviations);
            // Searches in many dimensions visit most of the cloud.
            let visited = n.min(5.0 * NEIGHBOURS as f64 * 2f64.powi(dimension.min(60) as i32));
            let substituted = 2.0 * n_deviations as f64 * (NEIGHBOURS as f64).powi(2);
            let flops = m * (FLOPS_PER_KRIGING + substituted + visited * (3.0 * d + 10.0));
            // What is found, and once more as it is answered.
            let at_queries = n_queries.saturating_mul(2 + 3 * n_deviations);
            (flops, rooms.saturating_add(n_points).saturating_add(jets).saturating_add(at_queries))
        }
        Asked::Geometry(asked) => {
            let flops = geometry_flops(asked, n_points, n_queries, dimension);
            (flops, (4 * n_points).saturating_add(at_queries).saturating_add(of_deviations(asked)))
        }
        Asked::LocalGeometry => (regression_flops(dimension) * m, at_queries),
        Asked::Stencils => {
            // A column, its place among the ordered ones and a number per component, once more while they are put together.
            let n_entries = 4 * (2 + dimension) * n_stencil_nodes(dimension.max(2));
            // A system of as many unknowns as there are nodes, for surfaces in space 3e5 of them.
            let of_stencil = FLOPS_PER_STENCIL
                * (n_entries_per_row(dimension) as f64 / n_entries_per_row(3) as f64).powi(3);
            let flops = (regression_flops(dimension) + of_stencil) * m + sampling_flops(n_points, dimension);
            (flops, at_queries.saturating_add(n_queries.saturating_mul(n_entries)))
        }
        Asked::Operator { n_surface_points, surface } => {
            let n_all = n_points.saturating_add(n_surface_points);
            let geometry = geometry_flops(surface, n_surface_points, n_queries, dimension);
            let sums = n * (40.0 * n + pair_flops(dimension, 2) * m);
            let numbers = n_all.saturating_mul(numbers_at_point(dimension)).saturating_add(at_queries);
            (geometry + sums, numbers.saturating_add(jets).saturating_add(of_deviations(surface)))
        }
        Asked::OperatorMatrix { n_surface_points, n_rows, surface } => {
            let geometry = geometry_flops(surface, n_surface_points, n_queries, dimension);
            (2.0 * n * n * n_rows as f64 + geometry, at_points.saturating_add(at_queries))
        }
    };
    Price { n_bytes: n_numbers.saturating_mul(size_of::<f64>()), flops }
}

impl Price {
    /// Both.
    pub fn and(self, other: Self) -> Self {
        Self { n_bytes: self.n_bytes.saturating_add(other.n_bytes), flops: self.flops + other.flops }
    }
}

/// Bytes of what is known of a list of values beside numbers at points and queries, and the work of keeping it.
const BYTES_PER_LIST: usize = 600;
const FLOPS_PER_LIST: f64 = 5000.0;

/// What k lists of values take beside the first: solves and sums in matrix products, and derivatives `n_derivatives` of each on their own.
pub fn many_price(n_points: usize, n_queries: usize, n_lists: usize, n_derivatives: usize) -> Price {
    let (n, m, k) = (n_points as f64, n_queries as f64, n_lists as f64);
    let of_derivatives = if n_derivatives > 0 { 40.0 * n * m } else { 0.0 };
    let numbers = n_points.saturating_mul(6).saturating_add(n_queries.saturating_mul(1 + n_derivatives));
    let n_bytes =
        n_lists.saturating_mul(numbers.saturating_mul(size_of::<f64>()).saturating_add(BYTES_PER_LIST));
    Price { n_bytes, flops: k * (6.0 * n * n + 2.0 * n * m + of_derivatives + FLOPS_PER_LIST) }
}

/// What so many joint draws at m queries take beside their covariance: its factor, and the draws.
pub fn samples_price(n_queries: usize, n_draws: usize) -> Price {
    let (m, count) = (n_queries as f64, n_draws as f64);
    let numbers = n_queries.saturating_mul(n_queries.saturating_mul(3).saturating_add(n_draws));
    let n_bytes = numbers.saturating_mul(size_of::<f64>());
    Price { n_bytes, flops: m * m * (m / 3.0 + 2.0 * count) }
}

/// Functionals whose weights, covariances and images are held at once: a pass over all pairs for each block.
pub(crate) const JUDGED_AT_ONCE: usize = 64;

/// What judging answers of an operator by so many functionals takes: their weights, and the covariances of another process with all values.
pub fn judging_price((n_points, dimension): (usize, usize), n_queries: usize, n_functionals: usize) -> Price {
    let (n, k) = (n_points as f64, n_functionals as f64);
    let n_blocks = n_functionals.div_ceil(JUDGED_AT_ONCE) as f64;
    let of_mean = 5 * (dimension + 1);
    let columns =
        n_points.saturating_mul(3 * n_functionals.min(JUDGED_AT_ONCE) + QUERIES_PER_BLOCK + of_mean);
    let numbers = columns.saturating_add(n_queries.saturating_mul(dimension + 3));
    let judging = Price {
        n_bytes: numbers
            .saturating_mul(size_of::<f64>())
            .saturating_add(n_functionals * functional_bytes(dimension)),
        flops: n * n * (4.0 * k + 40.0 * n_blocks)
            + 2.0 * n * k * covariance_flops(dimension)
            + 1000.0 * n_queries as f64,
    };
    // The sampling of a cloud of which nobody has asked it.
    let (n_bytes, flops) = (sampling_bytes(n_points, dimension), sampling_flops(n_points, dimension));
    judging.and(Price { n_bytes, flops })
}

/// Bytes of a functional of jets while it is looked at, twice.
fn functional_bytes(dimension: usize) -> usize {
    let beyond_the_stack = if dimension * dimension > 16 { dimension * dimension } else { 0 };
    2 * (400 + beyond_the_stack * size_of::<f64>())
}

/// What an operator takes on values that are kriged around each query: derivatives of second order with their covariances, among the points or
/// among means of them, which are found as a cloud is sampled.
pub fn kriged_operator_price(n_points: usize, n_queries: usize, dimension: usize) -> Price {
    let n_derivatives = dimension.saturating_mul(dimension + 3) / 2;
    let kriging = Asked::Moving { n_deviations: n_derivatives };
    let (n_bytes, flops) = (sampling_bytes(n_points, dimension), sampling_flops(n_points, dimension));
    work_price(kriging, n_points, n_queries, dimension).and(Price { n_bytes, flops })
}

/// What the deviations of so many functionals take, as variances do.
pub fn deviations_price(n_points: usize, n_functionals: usize, dimension: usize) -> Price {
    let n = n_points as f64;
    let n_at_once = n_functionals.min(VARIANCES_AT_ONCE);
    // With what a mean takes.
    let columns = n_points.saturating_mul(n_at_once + dimension + 5).saturating_mul(size_of::<f64>());
    let found = n_functionals.saturating_mul(4 * size_of::<f64>());
    let n_bytes = columns.saturating_add(found).saturating_add(n_at_once * functional_bytes(dimension));
    let flops = n * (whitening_flops(n) + covariance_flops(dimension)) * n_functionals as f64;
    Price { n_bytes, flops }
}

/// Flops for each entry of a column that is whitened: half of a triangle is read for it, at the speed of a
/// factorization where that is large.
fn whitening_flops(n: f64) -> f64 {
    0.75 * n + 750.0
}

/// Flops of the covariance of a functional of jets with a value: distance, kernel, and the terms of the
/// functional.
fn covariance_flops(dimension: usize) -> f64 {
    60.0 + 10.0 * dimension as f64
}

/// Numbers that a solve for new values takes at a point: the point, its value, two sets of weights with their sums and residuals
/// while one is refined, and a correction.
fn numbers_at_point(dimension: usize) -> usize {
    10 + dimension
}

/// Numbers that the geometry at a query takes: two jets, normal, curvatures, directions, what is said about it, and its
/// neighbours.
fn numbers_at_query(dimension: usize) -> usize {
    20 + 6 * dimension * dimension + 2 * n_quadric_neighbours(dimension)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_takes_half_its_square_and_the_fallback_all_of_it() {
        let choice = choose(20_000, 3, 4 << 30);
        assert_eq!((choice.solver, choice.reason), (SolverKind::Dense, Reason::Fits));
        let square = 20_000usize.pow(2) * 8;
        assert!((square / 2..square * 52 / 100).contains(&choice.expected.n_bytes), "{choice:?}");
        assert!((square..square * 101 / 100).contains(&choice.at_most.n_bytes));
        assert!(
            (choice.expected.flops - 8e12 / 3.0).abs() < 1e3 && choice.at_most.flops > choice.expected.flops
        );
        assert_eq!(choose(20_000, 3, 1 << 30).reason, Reason::NothingSmaller);
    }

    #[test]
    fn what_cannot_be_counted_costs_everything() {
        assert_eq!(choose(usize::MAX / 2, 3, usize::MAX).at_most.n_bytes, usize::MAX);
        let price = work_price(Asked::Posterior { variances: true, covariance: true }, 1 << 40, 1 << 40, 3);
        assert_eq!(price.n_bytes, usize::MAX);
    }

    #[test]
    fn more_of_anything_never_costs_less() {
        let surface = |offsets| AskedOfSurface { offsets, has_own_quadrics: true, has_deviations: true };
        let all = |n: usize| {
            [
                Asked::Function { order: 0 },
                Asked::Function { order: 2 },
                Asked::Posterior { variances: false, covariance: false },
                Asked::Posterior { variances: true, covariance: false },
                Asked::Posterior { variances: true, covariance: true },
                Asked::Moving { n_deviations: 0 },
                Asked::Moving { n_deviations: 10 },
                Asked::Geometry(surface(Offsets::Rescues)),
                Asked::Geometry(surface(Offsets::Confirmations)),
                Asked::Geometry(surface(Offsets::Everywhere)),
                Asked::Operator { n_surface_points: n, surface: surface(Offsets::Confirmations) },
                Asked::OperatorMatrix {
                    n_surface_points: n,
                    n_rows: n,
                    surface: surface(Offsets::Confirmations),
                },
            ]
        };
        let sizes = [1, 10, 600, 30_000];
        for (few, many) in sizes.iter().zip(&sizes[1..]) {
            for (a, b) in all(*few).into_iter().zip(all(*many)) {
                for d in [1, 3, 16] {
                    let (small, large) = (work_price(a, *few, *few, d), work_price(b, *many, *many, d));
                    assert!(small.flops < large.flops && small.n_bytes < large.n_bytes, "{a:?}");
                }
            }
            let (small, large) = (choose(*few, 3, 0), choose(*many, 3, 0));
            assert!(small.expected.flops < large.expected.flops && small.surface.flops < large.surface.flops);
        }
    }
}
