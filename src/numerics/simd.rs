//! Blocks of lanes that the compiler vectorises, and an exponential that it can vectorise too.
//!
//! Everything here is safe code. [`pulp::Arch`] compiles each loop nest for AVX-512, AVX2 with FMA, NEON and the portable
//! baseline, and picks one at run time; the loops run over fixed-size arrays so that they need no tail.

use pulp::Simd;

/// Number of pairs that one pass of a kernel loop works on: small enough for its temporaries to stay in the L1 cache at
/// d = 3 (14 arrays of 512 bytes), large enough to hide the latency of the exponential.
pub(crate) const BLOCK: usize = 64;

/// Independent partial sums per accumulator: one AVX-512 register of f64.
pub(crate) const LANES: usize = 8;

/// One value per pair of a block.
pub(crate) type Block = [f64; BLOCK];

/// One value per lane.
pub(crate) type Lanes = [f64; LANES];

/// `a·b + c`, fused where the instruction set fuses (elsewhere a library call would cost more than it is worth).
#[inline(always)]
pub(crate) fn fma<S: Simd>(a: f64, b: f64, c: f64) -> f64 {
    if S::IS_SCALAR { a * b + c } else { a.mul_add(b, c) }
}

/// `acc[lane] += Σ a·b` over the pairs of the lane.
#[inline(always)]
pub(crate) fn add_products<S: Simd>(acc: &mut Lanes, a: &Block, b: &Block) {
    let mut sums = *acc;
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for lane in 0..LANES {
            sums[lane] = fma::<S>(a[lane], b[lane], sums[lane]);
        }
    }
    *acc = sums;
}

/// `out = a·b`, pair by pair.
#[inline(always)]
pub(crate) fn multiply(out: &mut Block, a: &Block, b: &Block) {
    for i in 0..BLOCK {
        out[i] = a[i] * b[i];
    }
}

/// Adds the lanes up, pairwise.
#[inline(always)]
pub(crate) fn sum_lanes(lanes: &Lanes) -> f64 {
    let [a, b, c, d, e, f, g, h] = *lanes;
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}

/// Below this, `exp` is subnormal; [`exp_nonpositive`] answers 0 there.
const SMALLEST_EXPONENT: f64 = -708.0;

/// 1/k! for k = 13 … 0.
const INVERSE_FACTORIALS: [f64; 14] = [
    1.605_904_383_682_161_3e-10,
    2.087_675_698_786_81e-9,
    2.505_210_838_544_172e-8,
    2.755_731_922_398_589e-7,
    2.755_731_922_398_589_3e-6,
    2.480_158_730_158_73e-5,
    1.984_126_984_126_984e-4,
    1.388_888_888_888_889e-3,
    8.333_333_333_333_333e-3,
    4.166_666_666_666_666_4e-2,
    0.166_666_666_666_666_66,
    0.5,
    1.0,
    1.0,
];

/// `exp(x)` for x ≤ 0, within 2 ulp; 0 below −708, where the true value is under 4e-308.
///
/// `x = k ln 2 + r` with |r| ≤ ½ ln 2 and ln 2 in two parts, the first with enough trailing zeros for `k·hi` to be exact
/// (Cody and Waite 1980), then the Taylor polynomial of degree 13, whose remainder is below 5e-18. Branch-free.
#[inline(always)]
pub(crate) fn exp_nonpositive<S: Simd>(x: f64) -> f64 {
    const LN_2_HI: f64 = 6.931_471_803_691_238e-1;
    const LN_2_LO: f64 = 1.908_214_929_270_587_7e-10;
    /// Adding 1.5·2⁵² rounds to the nearest integer and leaves that integer in the low bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;

    let bounded = if x < SMALLEST_EXPONENT { SMALLEST_EXPONENT } else { x };
    let shifted = fma::<S>(bounded, std::f64::consts::LOG2_E, ROUND);
    let k = shifted - ROUND;
    let r = fma::<S>(k, -LN_2_HI, bounded);
    let r = fma::<S>(k, -LN_2_LO, r);
    let mut p = INVERSE_FACTORIALS[0];
    for coefficient in &INVERSE_FACTORIALS[1..] {
        p = fma::<S>(p, r, *coefficient);
    }
    // p lies in [0.7, 1.42]; adding k to its exponent field multiplies it by 2ᵏ.
    let scaled = f64::from_bits(p.to_bits().wrapping_add(shifted.to_bits() << 52));
    if x < SMALLEST_EXPONENT { 0.0 } else { scaled }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Exponentials(Vec<f64>);

    impl pulp::WithSimd for Exponentials {
        type Output = Vec<f64>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, _simd: S) -> Vec<f64> {
            self.0.iter().map(|&x| exp_nonpositive::<S>(x)).collect()
        }
    }

    fn assert_within_two_ulp(arguments: &[f64], results: &[f64]) {
        for (&x, &found) in arguments.iter().zip(results) {
            // libm's exp is itself within 1 ulp, so 2 ulp of it is what two correct implementations may differ by.
            let expected = x.exp();
            let ulp = f64::from_bits(expected.to_bits() + 1) - expected;
            assert!((found - expected).abs() <= 2.0 * ulp, "exp({x}) = {expected:e}, found {found:e}");
        }
    }

    #[test]
    fn exp_is_within_two_ulp_over_its_range_on_every_instruction_set() {
        let mut arguments: Vec<f64> = (0..700_000).map(|i| -f64::from(i) * 1.01e-3).collect();
        arguments.extend((0..300).map(|e| -(0.5f64.powi(e))));
        arguments.retain(|&x| x >= SMALLEST_EXPONENT);
        assert_within_two_ulp(&arguments, &pulp::Arch::new().dispatch(Exponentials(arguments.clone())));
        let portable = pulp::WithSimd::with_simd(Exponentials(arguments.clone()), pulp::Scalar::new());
        assert_within_two_ulp(&arguments, &portable);
    }

    #[test]
    fn exp_far_below_zero_is_zero() {
        let results = pulp::Arch::new().dispatch(Exponentials(vec![-708.1, -1e300, f64::NEG_INFINITY]));
        assert_eq!(results, [0.0; 3]);
    }
}
