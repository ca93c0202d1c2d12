//! Inverse multiquadric kernel: φ(q) = (1 + q)^{−½}.

use pulp::Simd;

use super::facts::{Facts, analytic_length_scale};
use super::profile::{HUGE, Profile};
use crate::machine::registers::Pack;
use crate::points::sampling::Scales;

pub(super) struct InverseMultiquadric;

impl Profile for InverseMultiquadric {
    /// φ = (1+q)^{−½}, φ′ = −½(1+q)^{−3/2}, φ″ = ¾(1+q)^{−5/2}.
    #[inline(always)]
    fn at<S: Simd>(&self, q: Pack<S>) -> [Pack<S>; 3] {
        let (_, phi) = (1.0 + q).at_most(HUGE).sqrt_and_inverse();
        let inverse = phi * phi;
        let first = -0.5 * phi * inverse;
        [phi, first, -1.5 * first * inverse]
    }
}

impl Facts for InverseMultiquadric {
    fn default_length_scale(&self, scales: &Scales) -> f64 {
        analytic_length_scale(scales)
    }

    /// Default ℓ for values, min(5 h₄, 2R). Like for Gauss, it is wider than for surfaces.
    fn length_scale_of_values(&self, scales: &Scales) -> f64 {
        (5.0 * scales.spacing).min(2.0 * scales.radius)
    }

    fn canonical(&self) -> (u8, f64) {
        (4, 0.0)
    }
}
