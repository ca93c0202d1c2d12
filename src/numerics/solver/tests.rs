use super::*;
use crate::numerics::kernel::Family;
use crate::numerics::kernel::tests::all_families;
use crate::numerics::observer::Unobserved;
use crate::numerics::testing::{circle, fibonacci_sphere};

fn factor(cloud: &Cloud, family: Family, length_scale: f64, alpha: f64) -> GramFactor {
    let kernel = Kernel::new(family, length_scale, 1.0).unwrap();
    let regularization = Regularization::uniform(alpha).unwrap();
    GramFactor::factorize(Arc::new(cloud.clone()), kernel, regularization, &Unobserved).unwrap()
}

#[test]
fn the_recursive_factorization_solves_beyond_one_leaf() {
    // 1,300 points: three levels of recursion, an odd split, a padded stride.
    let cloud = fibonacci_sphere(1300);
    let factor = factor(&cloud, Family::Matern { order: 1 }, 0.3, 1e-3);
    let values: Vec<f64> = cloud.points().map(|x| x[2]).collect();
    let solution = Solution::of(&factor, &values, &Unobserved).unwrap();
    assert_eq!(factor.method(), Method::Cholesky);
    assert!(solution.relative_residual < 1e-13, "{}", solution.relative_residual);
    assert!(!solution.refined);
}

#[test]
fn every_kernel_interpolates_at_alpha_zero() {
    let cloud = fibonacci_sphere(60);
    let values: Vec<f64> = cloud.points().map(|x| x[0] - 2.0 * x[1] * x[2]).collect();
    for family in all_families() {
        let factor = factor(&cloud, family, 0.8, 0.0);
        let solution = Solution::of(&factor, &values, &Unobserved).unwrap();
        assert!(solution.misfit < 1e-9, "{family:?}: {}", solution.misfit);
    }
}

#[test]
fn the_fallback_serves_what_cholesky_cannot() {
    // Gauss on 512 points of the sphere at α = 0 has condition 1e19 (numerics.md, Fit 2).
    let cloud = fibonacci_sphere(512);
    let factor = factor(&cloud, Family::Gauss, 1.0, 0.0);
    assert_eq!(factor.method(), Method::PivotedCholesky);
    assert!(factor.rank() < 512 && factor.rank() > 100, "{}", factor.rank());
    let values: Vec<f64> = cloud.points().map(|x| x[2] * x[0]).collect();
    let solution = Solution::of(&factor, &values, &Unobserved).unwrap();
    assert!(solution.relative_residual < 1e-6, "{}", solution.relative_residual);
    assert!(factor.log_determinant().is_err());
}

#[test]
fn the_transposed_solve_is_the_transpose() {
    for length_scale in [0.3, 3.0] {
        let cloud = fibonacci_sphere(90);
        let factor = factor(&cloud, Family::Gauss, length_scale, 0.0);
        let vector = |s: f64| (0..90).map(|i| (s * i as f64).sin()).collect::<Vec<f64>>();
        let (y, g) = (vector(0.9), vector(0.4));
        let (mut wy, mut wtg) = (y.clone(), g.clone());
        factor.solve_in_place(MatMut::from_column_major_slice_mut(&mut wy, 90, 1));
        factor.solve_transposed_in_place(MatMut::from_column_major_slice_mut(&mut wtg, 90, 1));
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (left, right) = (dot(&g, &wy), dot(&wtg, &y));
        let scale = dot(&wy, &wy).sqrt() * 10.0;
        assert!((left - right).abs() < 1e-9 * scale, "ℓ = {length_scale}: {left} against {right}");
    }
}

#[test]
fn coinciding_points_need_regularization() {
    let cloud = Cloud::new(vec![0.0, 0.0, 1.0, 0.0, 0.0, 0.0], 2).unwrap();
    let kernel = Kernel::new(Family::Gauss, 1.0, 1.0).unwrap();
    let outcome = |regularization: Regularization| {
        GramFactor::factorize(Arc::new(cloud.clone()), kernel, regularization, &Unobserved)
            .map(|f| f.method())
    };
    let refusal = Err(NumericsError::DuplicatePoints { points: vec![0, 2] });
    assert_eq!(outcome(Regularization::Uniform(0.0)), refusal);
    assert_eq!(outcome(Regularization::PerPoint(vec![0.0, 1.0, 0.0])), refusal);
    assert_eq!(outcome(Regularization::PerPoint(vec![0.0, 0.0, 0.1])), Ok(Method::Cholesky));
    assert_eq!(outcome(Regularization::Uniform(0.1)), Ok(Method::Cholesky));
}

#[test]
fn values_that_no_expansion_can_reach_are_refused_with_a_remedy() {
    // A wide Gauss kernel cannot follow alternating values in float64.
    let cloud = circle(200);
    let factor = factor(&cloud, Family::Gauss, 4.0, 0.0);
    let values: Vec<f64> = (0..200).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
    match Solution::of(&factor, &values, &Unobserved) {
        Err(NumericsError::NotPositiveDefinite { minimum_alpha, .. }) => {
            assert!(minimum_alpha > 0.0 && minimum_alpha < 1e-7);
            let kernel = *factor.kernel();
            let remedy = Regularization::uniform(minimum_alpha).unwrap();
            let again = GramFactor::factorize(Arc::new(cloud), kernel, remedy, &Unobserved).unwrap();
            assert!(Solution::of(&again, &values, &Unobserved).is_ok());
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_cancelled_factorization_stops() {
    struct Cancelled;
    impl Observer for Cancelled {
        fn enter(&self, _stage: Stage) {}
        fn is_cancelled(&self) -> bool {
            true
        }
    }
    let kernel = Kernel::new(Family::Gauss, 1.0, 1.0).unwrap();
    let cloud = Arc::new(fibonacci_sphere(50));
    let outcome = GramFactor::factorize(cloud, kernel, Regularization::Uniform(1.0), &Cancelled);
    assert!(matches!(outcome, Err(NumericsError::Cancelled)));
}

#[test]
fn the_reciprocal_condition_is_one_for_the_identity() {
    // Points far apart in a compactly supported kernel: K is the identity.
    let cloud = Cloud::new((0..30).map(|i| 10.0 * f64::from(i)).collect(), 1).unwrap();
    let kernel_family = Family::Wendland { smoothness: crate::numerics::kernel::WendlandSmoothness::C2 };
    assert!((factor(&cloud, kernel_family, 1.0, 0.0).reciprocal_condition() - 1.0).abs() < 1e-14);
}
