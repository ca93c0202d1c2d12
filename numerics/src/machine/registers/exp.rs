//! The exponential of the kernel loops.

use pulp::Simd;

use super::Pack;

/// Coefficients of degrees 11 … 0 of a polynomial for `e^{−u}`, |u| ≤ ½ ln 2.
///
/// It has the least relative error with the coefficients of degrees 0 and 1 held at 1 and −1. They were
/// computed by a Remez exchange in 60 digits, then rounded to f64. The relative error is 1.1e-17, a tenth of
/// an ulp. Degree 10 would have 2.9e-16.
const COEFFICIENTS: [f64; 12] = [
    -2.500_007_161_484_145_5e-8,
    2.763_023_390_223_09e-7,
    -2.755_758_626_852_146_5e-6,
    2.480_149_313_623_716e-5,
    -1.984_126_950_677_741e-4,
    1.388_888_894_359_764_9e-3,
    -8.333_333_333_494_335e-3,
    4.166_666_666_653_027e-2,
    -0.166_666_666_666_664_13,
    0.500_000_000_000_001_1,
    -1.0,
    1.0,
];

/// Argument t beyond which `e^{−t}` is below half of the smallest subnormal.
const VANISHES: f64 = 746.0;

/// Returns `e^{−t}` for t ≥ 0, within 1 ulp with fused multiply-add and 2 ulp without, through the subnormals
/// down to 0. Infinity gives 0.
///
/// The argument is reduced to `u = t − k ln 2` with |u| ≤ ½ ln 2. There ln 2 is split into two parts, and the
/// first has enough trailing zeros for `k·hi` to be exact (Cody and Waite 1980). A polynomial gives `e^{−u}`,
/// then k is added to its exponent.
///
/// The code is branch-free. A scale of 2⁶⁴ keeps the exponent field above 0, and the multiplication that
/// undoes the scale rounds a subnormal result correctly.
#[inline(always)]
pub(crate) fn exp_minus<S: Simd, const N: usize>(t: Pack<S, N>) -> Pack<S, N> {
    const LN_2_HI: f64 = 6.931_471_803_691_238e-1;
    const LN_2_LO: f64 = 1.908_214_929_270_587_7e-10;
    /// Adding 1.5·2⁵² rounds to the nearest integer and leaves that integer in the low bits. Here it is
    /// k + 64, to include the scale 2⁶⁴.
    const ROUND: f64 = 6_755_399_441_055_744.0 + 64.0;
    /// 2⁻⁶⁴.
    const UNSCALE: f64 = 5.421_010_862_427_522e-20;

    let simd = t.simd();
    let splat = |x| Pack::splat(simd, x);
    let bounded = t.at_most(VANISHES);
    let shifted = bounded.mul_add(splat(-std::f64::consts::LOG2_E), splat(ROUND));
    let k = shifted - ROUND;
    let u = k.mul_add(splat(LN_2_HI), bounded);
    let u = k.mul_add(splat(LN_2_LO), u);
    let mut p = splat(COEFFICIENTS[0]);
    for &coefficient in &COEFFICIENTS[1..] {
        p = p.mul_add(u, splat(coefficient));
    }
    // Beyond the range, multiplying by 0 avoids an underflow, for which some processors take a hundred
    // cycles.
    p.scale_by_power_of_two(shifted) * bounded.select_below(VANISHES, UNSCALE, 0.0)
}

#[cfg(test)]
mod tests {
    use pulp::WithSimd;

    use super::*;
    use crate::machine::instruction_set::InstructionSet;
    use crate::machine::registers::{BLOCK, Block};

    struct Exponentials<'a>(&'a [f64]);

    impl WithSimd for Exponentials<'_> {
        type Output = Vec<f64>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
            let mut results = Vec::new();
            for arguments in self.0.chunks(BLOCK) {
                let mut block = Block::ZERO;
                block.0[..arguments.len()].copy_from_slice(arguments);
                for at in 0..Pack::<S>::PER_BLOCK {
                    exp_minus(Pack::<S>::load(simd, &block, at)).store(&mut block, at);
                }
                results.extend_from_slice(&block.0[..arguments.len()]);
            }
            results
        }
    }

    /// Returns the error of `found` as `e^{−t}`, in ulp of the exact value (of the subnormals if it
    /// is one).
    ///
    /// The exact value is `2^{−k} s`, with s the Taylor series of `e^{−u}` in pairs of f64 (Dekker 1971). At
    /// |u| ≤ 0.35, its 30 terms leave an error of 1e-46. `u = t − k ln 2` takes ln 2 to 86 bits. So s is
    /// accurate to 1e-22, a millionth of an ulp.
    fn error_in_ulp(t: f64, found: f64) -> f64 {
        let k = (t / std::f64::consts::LN_2).round();
        let product = k * 1.908_214_929_270_587_7e-10;
        let product_error = k.mul_add(1.908_214_929_270_587_7e-10, -product);
        // This is exact: the factor has 33 bits, and the two numbers are within a factor of 2 of each other.
        let high = t - k * 6.931_471_803_691_238e-1;
        let u = two_sum(high, -product);
        let u = (u.0, u.1 - product_error);
        let mut s = (1.0, 0.0);
        for j in (1..=30).rev() {
            let (high, low) = multiply(s, u);
            let quotient = high / f64::from(j);
            let remainder = (-quotient).mul_add(f64::from(j), high) + low;
            let (high, low) = two_sum(1.0, -quotient);
            s = two_sum(high, low - remainder / f64::from(j));
        }
        let k = k as i32;
        let ulp = 2f64.powi(if s.0 < 1.0 { -53 } else { -52 }).max(2f64.powi(k - 1074));
        ((found * 2f64.powi(k / 2) * 2f64.powi(k - k / 2) - s.0) - s.1) / ulp
    }

    fn two_sum(a: f64, b: f64) -> (f64, f64) {
        let sum = a + b;
        let b_part = sum - a;
        (sum, (a - (sum - b_part)) + (b - b_part))
    }

    fn multiply(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
        let product = a.0 * b.0;
        two_sum(product, a.0.mul_add(b.0, -product) + (a.0 * b.1 + a.1 * b.0))
    }

    /// Returns arguments in every binade from the smallest subnormal to the end of the range. Added are the
    /// ties of the reduction, and the steps into the subnormals and to 0.
    fn arguments() -> Vec<f64> {
        // A Weyl sequence is equidistributed, and no two of its scaled numbers share their trailing bits.
        let uniform = |i: i32| (f64::from(i) * 0.618_033_988_749_894_9).fract();
        let mut arguments: Vec<f64> = (0..300_000).map(|i| VANISHES * uniform(i)).collect();
        for exponent in -1074..=9 {
            arguments.extend((0..50).map(|i| (1.0 + uniform(i)) * 2f64.powi(exponent)));
        }
        let mut near =
            |x: f64| arguments.extend((-3i64..=3).map(|i| f64::from_bits((x.to_bits() as i64 + i) as u64)));
        (0..1076).for_each(|k| near((f64::from(k) + 0.5) * std::f64::consts::LN_2));
        [708.396_418_532_264_1, 744.440_071_921_381_3, 745.133_219_101_941_1, VANISHES]
            .into_iter()
            .for_each(near);
        arguments.retain(|&t| t < 747.0);
        arguments.push(0.0);
        arguments
    }

    #[test]
    fn the_exponential_is_within_two_ulp_over_its_range_on_every_instruction_set() {
        // Under 1.5 ulp come from rounding: in Horner's last two steps, in u and, unfused, in the products
        // before. The polynomial itself adds 0.1 ulp.
        let arguments = arguments();
        for set in InstructionSet::available() {
            let mut worst = 0.0f64;
            for (&t, found) in arguments.iter().zip(set.dispatch(Exponentials(&arguments))) {
                let error = error_in_ulp(t, found).abs();
                assert!(error <= 2.0, "exp(-{t:e}) on {}: {found:e} is off by {error} ulp", set.name());
                worst = worst.max(error);
            }
            println!("{}: at most {worst:.3} ulp", set.name());
        }
    }

    #[test]
    fn the_reference_agrees_with_the_library() {
        // libm is within 1 ulp.
        for t in [0.0, 1e-300, 0.3, 1.0, 17.25, 300.1, 708.0, 720.5, 744.9] {
            assert!(error_in_ulp(t, (-t).exp()).abs() <= 1.0, "{t}");
        }
    }

    #[test]
    fn beyond_the_range_the_exponential_is_zero() {
        for set in InstructionSet::available() {
            let results = set.dispatch(Exponentials(&[745.2, 746.0, 1e4, 1e300, f64::INFINITY]));
            assert_eq!(results, [0.0; 5], "{}", set.name());
        }
    }
}
