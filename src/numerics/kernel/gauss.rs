//! Gauss: φ(q) = exp(−q), so k = variance · exp(−|x − y|²/ℓ²), without a factor ½ (errata.md, "Settled").

use pulp::Simd;

use crate::numerics::simd::exp_nonpositive;

/// φ, φ′, φ″ = e^{−q}, −e^{−q}, e^{−q}.
#[inline(always)]
pub(super) fn profile<S: Simd>(q: f64) -> [f64; 3] {
    let e = exp_nonpositive::<S>(-q);
    [e, -e, e]
}
