//! Regularised Laplace kernel: φ(q) = exp(−t), t = √(q + epsilon).
//!
//! It is analytic if epsilon > 0 and has a kink at 0 if epsilon = 0. It is not normalised:
//! φ(0) = e^{−√epsilon} (errata.md, "Settled").

use pulp::Simd;

use super::facts::Facts;
use super::profile::{HUGE, Profile, distance_and_inverse};
use crate::machine::registers::Pack;
use crate::machine::registers::exp::exp_minus;
use crate::points::sampling::Scales;

pub(super) struct Laplace {
    pub(super) epsilon: f64,
}

impl Profile for Laplace {
    /// φ = e^{−t}, φ′ = −e^{−t}/(2t), φ″ = e^{−t}(1/t² + 1/t³)/4.
    #[inline(always)]
    fn at<S: Simd>(&self, q: Pack<S>) -> [Pack<S>; 3] {
        let (t, inverse) = distance_and_inverse(q + self.epsilon, HUGE);
        let e = exp_minus(t);
        let first = -0.5 * e * inverse;
        [e, first, -0.5 * first * inverse.mul_add(inverse, inverse)]
    }
}

impl Facts for Laplace {
    fn refused(&self) -> Option<(&'static str, &'static str)> {
        (!(0.0..=1e5).contains(&self.epsilon)).then_some(("epsilon", "must be between 0 and 1e5"))
    }

    fn at_zero(&self) -> f64 {
        (-self.epsilon.sqrt()).exp()
    }

    fn has_kink(&self) -> bool {
        self.epsilon == 0.0
    }

    fn cusp_width(&self) -> Option<f64> {
        Some(self.epsilon.sqrt())
    }

    fn default_length_scale(&self, scales: &Scales) -> f64 {
        0.5 * scales.radius
    }

    fn canonical(&self) -> (u8, f64) {
        (1, self.epsilon)
    }
}
