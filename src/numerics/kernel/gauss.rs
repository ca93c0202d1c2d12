//! Gauss: φ(q) = exp(−q), so k = variance · exp(−|x − y|²/ℓ²), without a factor ½ (errata.md, "Settled").

use pulp::Simd;

use super::Profile;
use crate::numerics::machine::exp::exp_minus;
use crate::numerics::machine::registers::Pack;

pub(super) struct Gauss;

impl Profile for Gauss {
    /// φ, φ′, φ″ = e^{−q}, −e^{−q}, e^{−q}.
    #[inline(always)]
    fn at<S: Simd>(&self, q: Pack<S>) -> [Pack<S>; 3] {
        let e = exp_minus(q);
        [e, -e, e]
    }
}
