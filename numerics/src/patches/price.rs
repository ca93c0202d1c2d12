//! Prices of local regressions.

use super::MAX_LOCAL_DIMENSION;

/// Levels at which a query is regressed: one where points are exact, two to four where they have noise.
const LEVELS: f64 = 1.7;

/// Flops of a local regression at one query by all models of the mixture. Dimensions without local
/// regressions take none.
pub(crate) fn regression_flops(dimension: usize) -> f64 {
    let at_one_level = match dimension {
        ..=2 => 2e5,
        3 => 3e5,
        MAX_LOCAL_DIMENSION => 3e6,
        _ => 0.0,
    };
    LEVELS * at_one_level
}

/// Regressions that choosing neighbourhoods and hyperparameters takes in large clouds. Small clouds take
/// `REGRESSIONS_PER_POINT` for each point.
const REGRESSIONS_TO_CHOOSE: usize = 500;
const REGRESSIONS_PER_POINT: usize = 5;

/// Flops of choosing neighbourhoods and hyperparameters.
pub(crate) fn choosing_flops(n_points: usize, dimension: usize) -> f64 {
    let n_regressions = n_points.saturating_mul(REGRESSIONS_PER_POINT).min(REGRESSIONS_TO_CHOOSE);
    n_regressions as f64 * regression_flops(dimension)
}
