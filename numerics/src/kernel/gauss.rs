//! Gauss kernel: φ(q) = exp(−q), so k = variance · exp(−|x − y|²/ℓ²).
//!
//! There is no factor ½ in the exponent (errata.md, "Settled").

use pulp::Simd;

use super::facts::{Facts, analytic_length_scale};
use super::profile::Profile;
use crate::machine::registers::Pack;
use crate::machine::registers::exp::exp_minus;
use crate::points::sampling::Scales;

pub(super) struct Gauss;

impl Profile for Gauss {
    /// φ, φ′, φ″ = e^{−q}, −e^{−q}, e^{−q}.
    #[inline(always)]
    fn at<S: Simd>(&self, q: Pack<S>) -> [Pack<S>; 3] {
        let e = exp_minus(q);
        [e, -e, e]
    }
}

impl Facts for Gauss {
    fn default_length_scale(&self, scales: &Scales) -> f64 {
        analytic_length_scale(scales)
    }

    /// Default ℓ for values, min(4 h₄, 2R). With it, the Laplacian of smooth values is off by 1e-8. With 3h,
    /// the default for surfaces, it is off by a tenth.
    fn length_scale_of_values(&self, scales: &Scales) -> f64 {
        (4.0 * scales.spacing).min(2.0 * scales.radius)
    }

    fn canonical(&self) -> (u8, f64) {
        (0, 0.0)
    }
}
