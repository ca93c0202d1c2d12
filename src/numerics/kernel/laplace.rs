//! Regularised Laplace: φ(q) = exp(−t), t = √(q + epsilon). Analytic if epsilon > 0, a kink at 0 if epsilon = 0. Not
//! normalised: φ(0) = e^{−√epsilon} (errata.md, "Settled").

use pulp::Simd;

use super::{Profile, TINY};
use crate::numerics::machine::exp::exp_minus;
use crate::numerics::machine::registers::Pack;

pub(super) struct Laplace {
    pub(super) epsilon: f64,
}

impl Profile for Laplace {
    /// φ = e^{−t}, φ′ = −e^{−t}/(2t), φ″ = e^{−t}(1/t² + 1/t³)/4.
    #[inline(always)]
    fn at<S: Simd>(&self, q: Pack<S>) -> [Pack<S>; 3] {
        let t = (q + self.epsilon).sqrt().at_least(TINY);
        let inverse = 1.0 / t;
        let e = exp_minus(t);
        let first = -0.5 * e * inverse;
        [e, first, -0.5 * first * inverse.mul_add(inverse, inverse)]
    }
}
