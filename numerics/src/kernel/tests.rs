//! A contract that all kernels share, and closed forms of families.

use pulp::WithSimd;

use super::*;
use crate::machine::instruction_set::InstructionSet;
use crate::machine::registers::{BLOCK, Block};
use crate::testing::all_families;

/// Computes φ, φ′, φ″ of a kernel with ℓ = 1 at one q, for every point of a block.
struct Profiles<'a>(&'a Kernel, f64);

impl WithSimd for Profiles<'_> {
    type Output = [Block; 3];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [Block; 3] {
        let mut blocks = [Block([self.1; BLOCK]); 3];
        self.0.profiles(simd, blocks.each_mut().map(Block::registers_mut::<S>));
        blocks
    }
}

/// Returns φ, φ′, φ″ on the best instruction set, and checks that all other sets agree.
fn profile(family: Family, q: f64) -> [f64; 3] {
    let kernel = Kernel::new(family, 1.0, 1.0).unwrap();
    let [best, others @ ..] = &InstructionSet::available()[..] else { unreachable!("one is always there") };
    let best = best.dispatch(Profiles(&kernel, q));
    for set in others {
        for (a, b) in best.iter().zip(set.dispatch(Profiles(&kernel, q))) {
            for (a, b) in a.0.iter().zip(b.0) {
                // Results differ by a few roundings, some of them fused on one side only.
                let close = (a - b).abs() <= 1e-14 * b.abs();
                assert!(close, "{family:?} at {q}: {a} at best, {b} on {}", set.name());
            }
        }
    }
    best.map(|block| block.0[BLOCK - 1])
}

#[test]
fn the_profile_starts_at_k_0() {
    for family in all_families() {
        let kernel = Kernel::new(family, 2.0, 3.0).unwrap();
        let expected = kernel.at_zero() / 3.0;
        assert!((profile(family, 0.0)[0] - expected).abs() <= 4.0 * f64::EPSILON * expected, "{family:?}");
    }
}

#[test]
fn derivatives_agree_with_central_differences() {
    for family in all_families() {
        for q in [0.03, 0.2, 0.47, 0.9, 1.7, 5.0] {
            // With step h, the truncation h²φ‴/6 and the rounding ε/h balance near 1e-5. Both stay under 1e-8
            // here.
            let h = 1e-5 * q;
            let (below, here, above) = (profile(family, q - h), profile(family, q), profile(family, q + h));
            for order in 0..2 {
                let difference = (above[order] - below[order]) / (2.0 * h);
                let scale = here[order + 1].abs().max(here[order].abs() / q).max(0.05);
                let error = (difference - here[order + 1]).abs() / scale;
                assert!(
                    error < 1e-8,
                    "{family:?} order {order} at {q}: {difference} against {}",
                    here[order + 1]
                );
            }
        }
    }
}

#[test]
fn profiles_fall_and_stay_nonnegative() {
    for family in all_families() {
        let values: Vec<f64> = (0..200).map(|i| profile(family, 0.05 * f64::from(i))[0]).collect();
        assert!(values.windows(2).all(|w| w[1] <= w[0]), "{family:?}");
        assert!(values.iter().all(|&v| v >= 0.0), "{family:?}");
    }
}

#[test]
fn half_integer_materns_match_their_textbook_forms() {
    for r in [0.1f64, 0.7, 2.3] {
        let (s1, s3, s5) = (r, 3f64.sqrt() * r, 5f64.sqrt() * r);
        let expected = [(-s1).exp(), (1.0 + s3) * (-s3).exp(), (1.0 + s5 + s5 * s5 / 3.0) * (-s5).exp()];
        for (order, expected) in expected.into_iter().enumerate() {
            let found = profile(Family::Matern { order: order as u8 }, r * r)[0];
            assert!((found - expected).abs() < 1e-15, "order {order}: {found} against {expected}");
        }
    }
}

#[test]
fn matern_one_half_is_the_laplace_kernel() {
    for q in [0.01, 0.5, 4.0] {
        let (a, b) = (profile(Family::Matern { order: 0 }, q), profile(Family::Laplace { epsilon: 0.0 }, q));
        for order in 0..3 {
            assert!((a[order] - b[order]).abs() < 1e-14 * b[order].abs());
        }
    }
}

#[test]
fn unbounded_second_derivatives_stay_finite_at_zero() {
    for family in all_families() {
        assert!(profile(family, 0.0).iter().all(|p| p.is_finite()), "{family:?}");
    }
}

#[test]
fn parameters_outside_their_range_are_refused() {
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-200, 1e200] {
        assert!(Kernel::new(Family::Gauss, bad, 1.0).is_err());
        assert!(Kernel::new(Family::Gauss, 1.0, bad).is_err());
    }
    assert!(Kernel::new(Family::Laplace { epsilon: -1e-9 }, 1.0, 1.0).is_err());
    assert!(Kernel::new(Family::Matern { order: 9 }, 1.0, 1.0).is_err());
    let wendland = Kernel::new(Family::Wendland { smoothness: WendlandSmoothness::C4 }, 1.0, 1.0).unwrap();
    assert!(wendland.check_dimension(3).is_ok() && wendland.check_dimension(4).is_err());
}

#[test]
fn far_away_every_profile_vanishes_and_stays_finite() {
    for family in all_families().into_iter().filter(|&f| f != Family::InverseMultiquadric) {
        for q in [1e8, 1e60, 1e120, 1e300] {
            assert_eq!(profile(family, q).map(f64::abs), [0.0; 3], "{family:?} at {q:e}");
        }
    }
    assert!(profile(Family::InverseMultiquadric, 1e300).iter().all(|p| p.abs() <= 1e-150));
}

#[test]
fn the_inverse_square_of_the_length_is_rounded_once() {
    // Squares of integers below 2²⁶ are exact, so x²·y − 1 shows the error of y = 1/x² exactly.
    for x in (3..100_000u32).step_by(7).map(f64::from) {
        let y = Kernel::new(Family::Gauss, x, 1.0).unwrap().inverse_square_length();
        let error = (x * x).mul_add(y, -1.0).abs();
        assert!(error <= 0.5 * f64::EPSILON, "1/{x}²: {error:e}");
    }
    for tiny in [1e-140, 1e140] {
        let kernel = Kernel::new(Family::Gauss, tiny, 1.0).unwrap();
        assert!((kernel.inverse_square_length() * tiny * tiny - 1.0).abs() <= 2.0 * f64::EPSILON);
    }
}

#[test]
fn profiles_decrease_and_their_slopes_are_bounded() {
    for family in all_families() {
        let kernel = Kernel::new(family, 1.0, 1.0).unwrap();
        for step in 1..2000 {
            let q = (0.005 * f64::from(step)).powi(2);
            let [phi, slope, _] =
                InstructionSet::best().dispatch(Profiles(&kernel, q)).map(|block| block.0[0]);
            assert!(phi <= kernel.at_zero() && -2.0 * slope * q.sqrt() <= MAX_SLOPE, "{family:?} at {q}");
        }
    }
}
