//! Uncertainty of the entailed height: the surface may have more or less beyond second order than its
//! curvature implies.

use super::LEAST_HEIGHT;

/// Prior deviation of the factor of the entailed height. Factor 0 means a shape operator that stays the same
/// along the surface.
const DOUBT: f64 = 0.3;

/// Posterior of the factor: the multiple of the entailed height that the heights contain beyond what was
/// subtracted.
///
/// The factor is one more term of the trend, with a normal prior of mean 0 and deviation [`DOUBT`].
pub(super) struct Doubt {
    pub mean: f64,
    pub variance: f64,
    /// Quadratic form q of the heights with the factor at its mean.
    pub quadratic: f64,
    /// Loss of log likelihood for the freedom of the factor.
    pub log_penalty: f64,
}

impl Doubt {
    /// Computes the posterior from the forms zᵀPz, eᵀPz and eᵀPe of heights z and entailed heights e. The
    /// scale s² used for it is that without the factor.
    pub(super) fn of(heights: f64, mixed: f64, entailed: f64, freedom: f64) -> Self {
        let scale = heights / freedom;
        let prior = DOUBT * DOUBT;
        let share = scale + prior * entailed;
        // NaN fails this comparison too.
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
