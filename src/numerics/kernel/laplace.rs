//! Regularised Laplace: φ(q) = exp(−t), t = √(q + epsilon). Analytic if epsilon > 0, a kink at 0 if epsilon = 0. Not
//! normalised: φ(0) = e^{−√epsilon} (errata.md, "Settled").

use pulp::Simd;

use super::TINY;
use crate::numerics::simd::exp_nonpositive;

/// φ = e^{−t}, φ′ = −e^{−t}/(2t), φ″ = e^{−t}(1/t² + 1/t³)/4.
#[inline(always)]
pub(super) fn profile<S: Simd>(q: f64, epsilon: f64) -> [f64; 3] {
    let t = (q + epsilon).sqrt();
    let t = if t < TINY { TINY } else { t };
    let inverse = 1.0 / t;
    let e = exp_nonpositive::<S>(-t);
    let first = 0.5 * e * inverse;
    [e, -first, 0.5 * first * (inverse + inverse * inverse)]
}
