//! Wendland's compactly supported functions φ_{3,1}, φ_{3,2}, φ_{3,3}, normalised to φ(0) = 1, support r < 1.
//!
//! Positive definite for d ≤ 3 (Wendland 1995, "Piecewise polynomial, positive definite and compactly supported radial
//! functions of minimal degree"). With r = √q, d/dq = (1/2r) d/dr.

use pulp::Simd;

use super::{Profile, TINY};
use crate::numerics::machine::registers::Pack;

/// r and 1 − r, cut off at the end of the support so that no power of r overflows beyond it.
#[inline(always)]
fn cut_off<S: Simd>(q: Pack<S>) -> (Pack<S>, Pack<S>) {
    let r = q.sqrt().at_most(1.0);
    (r, 1.0 - r)
}

pub(super) struct C2;

impl Profile for C2 {
    /// C²: φ = (1−r)⁴(4r+1), φ′ = −10(1−r)³, φ″ = 15(1−r)²/r.
    #[inline(always)]
    fn at<S: Simd>(&self, q: Pack<S>) -> [Pack<S>; 3] {
        let (r, w) = cut_off(q);
        let w2 = w * w;
        [w2 * w2 * (4.0 * r + 1.0), -10.0 * w2 * w, 15.0 * w2 / r.at_least(TINY)]
    }
}

pub(super) struct C4;

impl Profile for C4 {
    /// C⁴: φ = (1−r)⁶(35r²+18r+3)/3, φ′ = −(28/3)(1−r)⁵(5r+1), φ″ = 140(1−r)⁴.
    #[inline(always)]
    fn at<S: Simd>(&self, q: Pack<S>) -> [Pack<S>; 3] {
        let (r, w) = cut_off(q);
        let w2 = w * w;
        let w4 = w2 * w2;
        [
            w4 * w2 * ((35.0 * r + 18.0) * r + 3.0) * (1.0 / 3.0),
            -(28.0 / 3.0) * w4 * w * (5.0 * r + 1.0),
            140.0 * w4,
        ]
    }
}

pub(super) struct C6;

impl Profile for C6 {
    /// C⁶: φ = (1−r)⁸(32r³+25r²+8r+1), φ′ = −11(1−r)⁷(16r²+7r+1), φ″ = 132(1−r)⁶(6r+1).
    #[inline(always)]
    fn at<S: Simd>(&self, q: Pack<S>) -> [Pack<S>; 3] {
        let (r, w) = cut_off(q);
        let w2 = w * w;
        let w4 = w2 * w2;
        [
            w4 * w4 * (((32.0 * r + 25.0) * r + 8.0) * r + 1.0),
            -11.0 * w4 * w2 * w * ((16.0 * r + 7.0) * r + 1.0),
            132.0 * w4 * w2 * (6.0 * r + 1.0),
        ]
    }
}
