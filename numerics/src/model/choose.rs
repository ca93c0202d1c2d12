//! Rules by which `auto` takes the local solver.

use crate::patches::MAX_LOCAL_DIMENSION;

/// Number of points from which `auto` regresses a surface locally, unless kernel or α are given.
///
/// The factorization alone would take more than a second.
pub const LOCAL_FROM: usize = 5_000;

/// Reason why `auto` chose the local solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AutoLocal {
    /// The cloud has more points than the dense solver accepts.
    BeyondDense,
    /// The cloud has many points, and the work of regressions is linear in them.
    ManyPoints,
    /// Standard deviations are requested, which only regressions have.
    Deviations,
}

/// Returns why a surface known only by its points is better regressed locally, or `None` if it is not.
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
