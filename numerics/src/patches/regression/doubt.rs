//! How far curvature may entail more, beyond second order, than is taken off the heights.

use super::LEAST_HEIGHT;

/// Deviation of the factor by which curvature entails more, beyond second order, than a shape operator that goes along unchanged.
const DOUBT: f64 = 0.3;

/// What the data say of the factor by which curvature entails more than was taken off the heights: a normal prior about 0 makes one
/// more term of the trend, with deviation.
pub(super) struct Doubt {
    pub mean: f64,
    pub variance: f64,
    /// q with the factor at its mean.
    pub quadratic: f64,
    /// What the likelihood loses for the choice.
    pub log_penalty: f64,
}

impl Doubt {
    /// From forms of heights z and of what is entailed e: zᵀPz, eᵀPz, eᵀPe. The scale is that without the factor.
    pub(super) fn of(heights: f64, mixed: f64, entailed: f64, freedom: f64) -> Self {
        let scale = heights / freedom;
        let prior = DOUBT * DOUBT;
        let share = scale + prior * entailed;
        // Not a number is not positive either.
        let is_informed = share > 0.0;
        if !is_informed {
            return Self { mean: 0.0, variance: prior, quadratic: heights, log_penalty: 0.0 };
        }
        let mean = prior * mixed / share;
        Self {
            mean,
            variance: prior * scale / share,
            quadratic: (heights - mean * mixed).max(freedom * LEAST_HEIGHT * LEAST_HEIGHT),
            log_penalty: if scale > 0.0 { 0.5 * (share / scale).ln() } else { 0.0 },
        }
    }
}
