//! Wendland's compactly supported functions φ_{3,1}, φ_{3,2}, φ_{3,3}, normalised to φ(0) = 1, support r < 1.
//!
//! They are positive definite for d ≤ 3 (Wendland 1995, "Piecewise polynomial, positive definite and
//! compactly supported radial functions of minimal degree"). With r = √q, d/dq = (1/2r) d/dr.

use pulp::Simd;

use super::facts::{Facts, SMOOTH_SPACINGS};
use super::profile::{Distances, Profile, Profiles, Terms, distance_and_inverse};
use crate::machine::registers::Pack;
use crate::points::sampling::Scales;

/// The greatest dimension in which φ_{3,k} is positive definite (Wendland 1995).
const MAX_DIMENSION: usize = 3;

/// Smoothness of a Wendland function: the number of its continuous derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WendlandSmoothness {
    C2,
    C4,
    C6,
}

pub(super) struct Wendland {
    pub(super) smoothness: WendlandSmoothness,
}

impl Profiles for Wendland {
    #[inline(always)]
    fn evaluate<S: Simd, const N: usize>(self, distances: Distances<'_, S, N>) {
        match self.smoothness {
            WendlandSmoothness::C2 => C2.evaluate(distances),
            WendlandSmoothness::C4 => C4.evaluate(distances),
            WendlandSmoothness::C6 => C6.evaluate(distances),
        }
    }

    #[inline(always)]
    fn fold<S: Simd>(self, inverse_square_length: f64, terms: &mut impl Terms<S>) {
        match self.smoothness {
            WendlandSmoothness::C2 => C2.fold(inverse_square_length, terms),
            WendlandSmoothness::C4 => C4.fold(inverse_square_length, terms),
            WendlandSmoothness::C6 => C6.fold(inverse_square_length, terms),
        }
    }
}

impl Facts for Wendland {
    fn max_dimension(&self) -> Option<usize> {
        Some(MAX_DIMENSION)
    }

    fn has_second_derivatives(&self) -> bool {
        self.smoothness != WendlandSmoothness::C2
    }

    /// Default ℓ, min(10 h₄, 4R). It is the radius of the support, which must reach well past the neighbours.
    fn default_length_scale(&self, scales: &Scales) -> f64 {
        (SMOOTH_SPACINGS * scales.spacing).min(4.0 * scales.radius)
    }

    fn canonical(&self) -> (u8, f64) {
        let smoothness = match self.smoothness {
            WendlandSmoothness::C2 => 2.0,
            WendlandSmoothness::C4 => 4.0,
            WendlandSmoothness::C6 => 6.0,
        };
        (3, smoothness)
    }
}

/// Returns r, 1 − r and 1/r, with r cut off at 1, the end of the support. So no power of r overflows beyond
/// it.
#[inline(always)]
fn cut_off<S: Simd>(q: Pack<S>) -> (Pack<S>, Pack<S>, Pack<S>) {
    let (r, inverse) = distance_and_inverse(q, 1.0);
    (r, 1.0 - r, inverse)
}

struct C2;

impl Profile for C2 {
    /// C²: φ = (1−r)⁴(4r+1), φ′ = −10(1−r)³, φ″ = 15(1−r)²/r.
    #[inline(always)]
    fn at<S: Simd>(&self, q: Pack<S>) -> [Pack<S>; 3] {
        let (r, w, inverse) = cut_off(q);
        let w2 = w * w;
        [w2 * w2 * (4.0 * r + 1.0), -10.0 * w2 * w, 15.0 * w2 * inverse]
    }
}

struct C4;

impl Profile for C4 {
    /// C⁴: φ = (1−r)⁶(35r²+18r+3)/3, φ′ = −(28/3)(1−r)⁵(5r+1), φ″ = 140(1−r)⁴.
    #[inline(always)]
    fn at<S: Simd>(&self, q: Pack<S>) -> [Pack<S>; 3] {
        let (r, w, _) = cut_off(q);
        let w2 = w * w;
        let w4 = w2 * w2;
        [
            w4 * w2 * ((35.0 * r + 18.0) * r + 3.0) * (1.0 / 3.0),
            -(28.0 / 3.0) * w4 * w * (5.0 * r + 1.0),
            140.0 * w4,
        ]
    }
}

struct C6;

impl Profile for C6 {
    /// C⁶: φ = (1−r)⁸(32r³+25r²+8r+1), φ′ = −11(1−r)⁷(16r²+7r+1), φ″ = 132(1−r)⁶(6r+1).
    #[inline(always)]
    fn at<S: Simd>(&self, q: Pack<S>) -> [Pack<S>; 3] {
        let (r, w, _) = cut_off(q);
        let w2 = w * w;
        let w4 = w2 * w2;
        [
            w4 * w4 * (((32.0 * r + 25.0) * r + 8.0) * r + 1.0),
            -11.0 * w4 * w2 * w * ((16.0 * r + 7.0) * r + 1.0),
            132.0 * w4 * w2 * (6.0 * r + 1.0),
        ]
    }
}
