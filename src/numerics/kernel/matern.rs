//! Half-integer Matérn, ν = p + ½: φ = e^{−s} θ_p(s)/θ_p(0), s = √(2ν q), with θ_p the reverse Bessel polynomials.
//!
//! Since s^ν K_ν(s) = √(π/2) e^{−s} θ_p(s) and (s^ν K_ν)′ = −s · s^{ν−1}K_{ν−1}, a derivative in q only lowers the index:
//! d/dq [e^{−s} θ_p] = −ν e^{−s} θ_{p−1} (Abramowitz and Stegun 1964, 9.6.28; Rasmussen and Williams 2006, eq. 4.16).

use pulp::Simd;

use super::TINY;
use crate::numerics::simd::{exp_nonpositive, fma};

/// Where e^{−s} is 0 in float64, and no power of s that meets it overflows.
const FAR: f64 = 1e3;

/// φ, φ′, φ″ with θ_{−1} = 1/s and θ_{−2} = (1 + s)/s³, which only the orders 0 and 1 meet.
#[inline(always)]
pub(super) fn profile<S: Simd, const P: usize>(q: f64) -> [f64; 3] {
    let nu = P as f64 + 0.5;
    let s = (2.0 * nu * q).sqrt();
    let s = if s < TINY { TINY } else { s };
    let s = if s > FAR { FAR } else { s };
    let s_squared = s * s;
    let inverse = 1.0 / s;
    // θ_{p−2}, θ_{p−1}, θ_p, raised one by one by θ_{p+1} = (2p + 1) θ_p + s² θ_{p−1}. Three numbers and no array: an array
    // would keep the compiler from vectorising the loop around this (0.04 against 0.5 G pairs/s).
    let (mut lowest, mut lower, mut theta) = ((1.0 + s) * inverse * inverse * inverse, inverse, 1.0);
    let mut at_zero = 1.0;
    for p in 0..P {
        let odd = (2 * p + 1) as f64;
        (lowest, lower, theta) = (lower, theta, fma::<S>(odd, theta, s_squared * lower));
        at_zero *= odd;
    }
    let e = exp_nonpositive::<S>(-s) * (1.0 / at_zero);
    [e * theta, -nu * e * lower, nu * nu * e * lowest]
}
