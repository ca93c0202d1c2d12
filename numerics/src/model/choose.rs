//! When `auto` takes the local solver.

use crate::patches::MAX_LOCAL_DIMENSION;

/// Points from which `auto` regresses a surface locally where nothing else is given: the factorization alone takes more
/// than a second.
pub const LOCAL_FROM: usize = 5_000;

/// Why `auto` chose the local solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AutoLocal {
    /// The cloud has more points than are factorized.
    BeyondDense,
    /// The work of regressions is linear in the points, of which there are many.
    ManyPoints,
    /// Standard deviations are asked for, which only regressions have.
    Deviations,
}

/// Whether a surface of which nothing is given but its points is better regressed locally, and why.
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
