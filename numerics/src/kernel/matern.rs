//! Half-integer Matérn kernels, ν = p + ½: φ = e^{−s} θ_p(s)/θ_p(0), s = √(2ν q).
//!
//! The θ_m are the reverse Bessel polynomials. A derivative in q only lowers the index. For s = √(2ν q) with
//! ν fixed and any index m: d/dq [e^{−s} θ_m] = −ν e^{−s} θ_{m−1}. Hence φ′ ∝ −ν e^{−s} θ_{p−1} and
//! φ″ ∝ ν² e^{−s} θ_{p−2}. With μ = m + ½, this follows from s^μ K_μ(s) = √(π/2) e^{−s} θ_m(s),
//! (s^μ K_μ)′ = −s · s^{μ−1}K_{μ−1} and ds/dq = ν/s (Abramowitz and Stegun 1964, 9.6.28; Rasmussen and
//! Williams 2006, eq. 4.16).

use pulp::Simd;

use super::facts::{Facts, SMOOTH_SPACINGS};
use super::laplace::Laplace;
use super::profile::{Distances, Profile, Profiles, Terms, distance_and_inverse};
use crate::machine::registers::Pack;
use crate::machine::registers::exp::exp_minus;
use crate::points::sampling::Scales;

/// The greatest order p of a Matérn kernel, ν = p + ½.
pub const MAX_MATERN_ORDER: u8 = 8;

/// Value at which s is cut off: e^{−s} is 0 in float64 there, and no power of s that multiplies it overflows.
const FAR: f64 = 1e3;

pub(super) struct Matern {
    pub(super) order: u8,
}

impl Profiles for Matern {
    #[inline(always)]
    fn evaluate<S: Simd, const N: usize>(self, distances: Distances<'_, S, N>) {
        match self.order {
            // Here s = √q, so φ = e^{−√q} is that of Laplace with ε = 0. Sharing it saves compiling a loop.
            0 => Laplace { epsilon: 0.0 }.evaluate(distances),
            1 => OfOrder::<1>.evaluate(distances),
            2 => OfOrder::<2>.evaluate(distances),
            order => OfAnyOrder { order }.evaluate(distances),
        }
    }

    #[inline(always)]
    fn fold<S: Simd>(self, inverse_square_length: f64, terms: &mut impl Terms<S>) {
        match self.order {
            0 => Laplace { epsilon: 0.0 }.fold(inverse_square_length, terms),
            1 => OfOrder::<1>.fold(inverse_square_length, terms),
            2 => OfOrder::<2>.fold(inverse_square_length, terms),
            order => OfAnyOrder { order }.fold(inverse_square_length, terms),
        }
    }
}

impl Facts for Matern {
    fn refused(&self) -> Option<(&'static str, &'static str)> {
        (self.order > MAX_MATERN_ORDER).then_some(("nu", "must be one of 0.5, 1.5, ..., 8.5"))
    }

    fn has_kink(&self) -> bool {
        self.order == 0
    }

    fn has_second_derivatives(&self) -> bool {
        self.order >= 2
    }

    fn cusp_width(&self) -> Option<f64> {
        self.has_kink().then_some(0.0)
    }

    fn default_length_scale(&self, scales: &Scales) -> f64 {
        (SMOOTH_SPACINGS * scales.spacing).min(2.0 * scales.radius)
    }

    fn canonical(&self) -> (u8, f64) {
        (2, f64::from(self.order))
    }
}

/// The profile of ν = P + ½, compiled for P = 1 and P = 2, the orders that are used most.
struct OfOrder<const P: u8>;

impl<const P: u8> Profile for OfOrder<P> {
    #[inline(always)]
    fn at<S: Simd>(&self, q: Pack<S>) -> [Pack<S>; 3] {
        profile(q, P)
    }
}

/// The profile of ν = order + ½ for any order. Its loop is not unrolled.
struct OfAnyOrder {
    order: u8,
}

impl Profile for OfAnyOrder {
    #[inline(always)]
    fn at<S: Simd>(&self, q: Pack<S>) -> [Pack<S>; 3] {
        profile(q, self.order)
    }
}

/// Returns φ, φ′, φ″ for an order of 1 or more.
#[inline(always)]
fn profile<S: Simd>(q: Pack<S>, order: u8) -> [Pack<S>; 3] {
    let nu = f64::from(order) + 0.5;
    let (s, inverse) = distance_and_inverse(2.0 * nu * q, FAR * FAR);
    let (s_squared, one) = (s * s, Pack::splat(q.simd(), 1.0));
    // `lowest`, `lower` and `theta` are θ_{p−2}, θ_{p−1} and θ_p, starting at p = 1. There θ_{−1} = 1/s,
    // which only order 1 uses. Each turn raises p by 1: θ_{p+1} = (2p + 1) θ_p + s² θ_{p−1}.
    let (mut lowest, mut lower, mut theta) = (if order == 1 { inverse } else { one }, one, 1.0 + s);
    // θ_p(0) = 1 · 3 · … · (2p − 1).
    let mut at_zero = 1.0;
    for p in 1..order {
        let odd = f64::from(2 * p + 1);
        (lowest, lower, theta) = (lower, theta, s_squared.mul_add(lower, odd * theta));
        at_zero *= odd;
    }
    let e = exp_minus(s) * (1.0 / at_zero);
    [e * theta, -nu * e * lower, nu * nu * e * lowest]
}
