use faer::Mat;

use faer::MatMut;

use super::*;
use crate::error::NumericsError;
use crate::kernel::Family;
use crate::observer::{Stage, Unobserved};
use crate::points::cloud::squared_distance;
use crate::testing::{StopAt, all_families, circle, fibonacci_sphere};

fn dense(cloud: &Cloud, family: Family, length_scale: f64, alpha: f64) -> Solver {
    let kernel = Kernel::new(family, length_scale, 1.0).unwrap();
    let regularization = Regularization::uniform(alpha).unwrap();
    System::new(Arc::new(cloud.clone()), kernel.clone(), regularization)
        .and_then(|system| Solver::dense(system, &Unobserved))
        .unwrap()
}

#[test]
fn the_recursive_factorization_solves_beyond_one_leaf() {
    // 1,300 points: three levels of recursion, an odd split, a padded stride.
    let cloud = fibonacci_sphere(1300);
    let solver = dense(&cloud, Family::Matern { order: 1 }, 0.3, 1e-3);
    let values: Vec<f64> = cloud.points().map(|x| x[2]).collect();
    let solution = Solution::of(&solver, &values, &Unobserved).unwrap();
    assert_eq!(solver.method(), Method::Cholesky);
    assert!(solution.relative_residual < 1e-13, "{}", solution.relative_residual);
    assert!(!solution.refined);
}

#[test]
fn every_kernel_interpolates_at_alpha_zero() {
    let cloud = fibonacci_sphere(60);
    let values: Vec<f64> = cloud.points().map(|x| x[0] - 2.0 * x[1] * x[2]).collect();
    for family in all_families() {
        let solver = dense(&cloud, family, 0.8, 0.0);
        let solution = Solution::of(&solver, &values, &Unobserved).unwrap();
        assert!(solution.misfit < 1e-9, "{family:?}: {}", solution.misfit);
    }
}

#[test]
fn the_fallback_serves_what_cholesky_cannot() {
    // Gauss on 512 points of the sphere at α = 0 has condition 1e19 (numerics.md, Fit 2).
    let cloud = fibonacci_sphere(512);
    let solver = dense(&cloud, Family::Gauss, 1.0, 0.0);
    assert_eq!(solver.method(), Method::PivotedCholesky);
    assert!(solver.rank() < 512 && solver.rank() > 100, "{}", solver.rank());
    let values: Vec<f64> = cloud.points().map(|x| x[2] * x[0]).collect();
    let solution = Solution::of(&solver, &values, &Unobserved).unwrap();
    assert!(solution.relative_residual < 1e-6, "{}", solution.relative_residual);
    assert!(solver.log_determinant().is_err());
}

#[test]
fn the_fallback_asks_before_it_takes_all_of_its_matrix() {
    // Pairs are so close that the kernel cannot tell them apart, so the rank is n/2. A smooth kernel has rank
    // n/20 and asks for nothing.
    let base = fibonacci_sphere(100);
    let pairs: Vec<f64> = base.points().flat_map(|x| [x[0], x[1], x[2], x[0] + 1e-10, x[1], x[2]]).collect();
    let cloud = Arc::new(Cloud::new(pairs, 3).unwrap());
    let alpha = Regularization::uniform(0.0).unwrap();
    let attempt = |length_scale: f64, answer: bool| {
        let kernel = Kernel::new(Family::Matern { order: 2 }, length_scale, 1.0).unwrap();
        let kernel =
            if length_scale > 1.0 { Kernel::new(Family::Gauss, length_scale, 1.0).unwrap() } else { kernel };
        let (spare, mut asked) = (SpareBuffer::up_to(0), Vec::new());
        let mut may_take = |n_bytes| {
            asked.push(n_bytes);
            answer
        };
        let workspace = Workspace { spare: &spare, may_take: &mut may_take };
        let solver = System::new(cloud.clone(), kernel.clone(), alpha.clone())
            .and_then(|system| Solver::dense_in(workspace, system, &Unobserved));
        (solver, asked)
    };
    let all = 200 * 200 * size_of::<f64>();
    let (refused, asked) = attempt(0.3, false);
    assert!(matches!(refused, Err(NumericsError::OutOfMemory { n_bytes }) if n_bytes == all));
    assert_eq!(asked, [all]);
    let (granted, asked) = attempt(0.3, true);
    let granted = granted.unwrap();
    assert!((51..=110).contains(&granted.rank()), "{}", granted.rank());
    assert_eq!(asked, [all]);
    let (smooth, asked) = attempt(20.0, false);
    assert!(smooth.unwrap().rank() < 50 && asked.is_empty());
}

#[test]
fn the_transposed_solve_is_the_transpose() {
    // Cholesky, then the fallback with more and with fewer pivots than other points.
    for (length_scale, ranks) in [(0.3, 90..91), (5.0, 46..90), (20.0, 1..45)] {
        let cloud = fibonacci_sphere(90);
        let solver = dense(&cloud, Family::Gauss, length_scale, 0.0);
        assert!(ranks.contains(&solver.rank()), "ℓ = {length_scale}: {}", solver.rank());
        let vector = |s: f64| (0..90).map(|i| (s * i as f64).sin()).collect::<Vec<f64>>();
        let (y, g) = (vector(0.9), vector(0.4));
        let (mut wy, mut wtg) = (y.clone(), g.clone());
        solver.solve_in_place(MatMut::from_column_major_slice_mut(&mut wy, 90, 1), &Unobserved).unwrap();
        solver
            .solve_transposed_in_place(MatMut::from_column_major_slice_mut(&mut wtg, 90, 1), &Unobserved)
            .unwrap();
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
        System::new(Arc::new(cloud.clone()), kernel.clone(), regularization)
            .and_then(|system| Solver::dense(system, &Unobserved))
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
    let solver = dense(&cloud, Family::Gauss, 4.0, 0.0);
    let values: Vec<f64> = (0..200).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
    match Solution::of(&solver, &values, &Unobserved) {
        Err(NumericsError::NotPositiveDefinite { minimum_alpha, .. }) => {
            assert!(minimum_alpha > 0.0 && minimum_alpha < 1e-7);
            let kernel = solver.kernel().clone();
            let remedy = Regularization::uniform(minimum_alpha).unwrap();
            let again = System::new(Arc::new(cloud), kernel, remedy)
                .and_then(|system| Solver::dense(system, &Unobserved))
                .unwrap();
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
    let outcome = System::new(cloud, kernel, Regularization::Uniform(1.0))
        .and_then(|system| Solver::dense(system, &Cancelled));
    assert!(matches!(outcome, Err(NumericsError::Cancelled)));
}

#[test]
fn the_fallback_stops_at_every_checkpoint() {
    let cloud = Arc::new(fibonacci_sphere(700));
    let kernel = Kernel::new(Family::Gauss, 1.0, 1.0).unwrap();
    let outcome = |checkpoint: usize| {
        let observer = StopAt::checkpoint(checkpoint);
        let solver = System::new(cloud.clone(), kernel.clone(), Regularization::Uniform(0.0))
            .and_then(|system| Solver::dense(system, &observer));
        (solver.map(|f| f.method()), observer.n_checkpoints())
    };
    let (method, n_checkpoints) = outcome(usize::MAX);
    assert_eq!(method, Ok(Method::PivotedCholesky));
    // The Gram matrix and Cholesky have fewer than 60 checkpoints. A pivot block has three.
    assert!(n_checkpoints > 100, "{n_checkpoints}");
    for checkpoint in (0..n_checkpoints).step_by(7) {
        assert_eq!(outcome(checkpoint).0, Err(NumericsError::Cancelled), "checkpoint {checkpoint}");
    }
}

#[test]
fn landmarks_and_iterations_stop_at_every_checkpoint() {
    let cloud = Arc::new(fibonacci_sphere(600));
    let values: Vec<f64> = cloud.points().map(|x| (2.0 * x[0]).sin()).collect();
    for family in [Family::Gauss, Family::Laplace { epsilon: 0.0 }] {
        let outcome = |checkpoint: usize| {
            let observer = StopAt::checkpoint(checkpoint);
            let kernel = Kernel::new(family, 1.0, 1.0).unwrap();
            let system = System::new(cloud.clone(), kernel, Regularization::Uniform(1e-3)).unwrap();
            let solver = match family {
                Family::Gauss => Solver::landmark(system, &observer),
                _ => Solver::iterative_to(1e-9, system, &observer),
            };
            let found = solver.and_then(|solver| Solution::of(&solver, &values, &observer));
            (found.map(|solution| solution.relative_residual <= 1e-9), observer.n_checkpoints())
        };
        let (found, n_checkpoints) = outcome(usize::MAX);
        assert_eq!(found, Ok(true));
        assert!(n_checkpoints > 10, "{family:?}: {n_checkpoints}");
        for checkpoint in (0..n_checkpoints).step_by(n_checkpoints.div_ceil(30)) {
            assert_eq!(outcome(checkpoint).0, Err(NumericsError::Cancelled), "{family:?}, {checkpoint}");
        }
    }
}

#[test]
fn rows_above_the_tolerance_are_reproduced_by_the_pivots() {
    // L₁₁L₁₁ᵀ is (K + D)(Z, Z). So solving for one of its columns gives a unit vector, noise variances
    // included.
    let cloud = fibonacci_sphere(200);
    let kernel = Kernel::new(Family::Gauss, 1.0, 1.0).unwrap();
    let noise: Vec<f64> = (0..200).map(|i| if i % 4 == 0 { 0.5 } else { 0.0 }).collect();
    let regularization = Regularization::per_point(noise.clone()).unwrap();
    let solver = System::new(Arc::new(cloud.clone()), kernel.clone(), regularization)
        .and_then(|system| Solver::dense(system, &Unobserved))
        .unwrap();
    let weights: Vec<f64> = (0..200).map(|i| if i % 4 == 0 { (i as f64).cos() } else { 0.0 }).collect();
    let values: Vec<f64> = (0..200)
        .map(|i| {
            let k = |j: usize| (-squared_distance(cloud.point(i), cloud.point(j))).exp();
            (0..200).map(|j| k(j) * weights[j]).sum::<f64>() + noise[i] * weights[i]
        })
        .collect();
    let solution = Solution::of(&solver, &values, &Unobserved).unwrap();
    assert!(solution.relative_residual < 1e-14, "{}", solution.relative_residual);
}

#[test]
fn the_reciprocal_condition_is_one_for_the_identity() {
    // Points are far apart for a compactly supported kernel, so K is the identity.
    let cloud = Cloud::new((0..30).map(|i| 10.0 * f64::from(i)).collect(), 1).unwrap();
    let kernel_family = Family::Wendland { smoothness: crate::kernel::WendlandSmoothness::C2 };
    assert!((dense(&cloud, kernel_family, 1.0, 0.0).reciprocal_condition().unwrap() - 1.0).abs() < 1e-14);
}

#[test]
fn nothing_of_what_was_in_the_memory_before_is_read() {
    let cloud = Arc::new(fibonacci_sphere(1300));
    let kernel = Kernel::new(Family::Matern { order: 2 }, 0.5, 1.0).unwrap();
    let alpha = Regularization::uniform(1e-6).unwrap();
    let spare = SpareBuffer::up_to(1 << 30);
    let mut poisoned = spare.take(1312 * 650).unwrap();
    poisoned.fill(f64::NAN);
    drop(poisoned);
    let workspace = Workspace { spare: &spare, may_take: &mut |_| unreachable!("it is well conditioned") };
    let recycled = System::new(cloud.clone(), kernel.clone(), alpha.clone())
        .and_then(|system| Solver::dense_in(workspace, system, &Unobserved))
        .unwrap();
    let fresh =
        System::new(cloud, kernel, alpha).and_then(|system| Solver::dense(system, &Unobserved)).unwrap();
    assert_eq!(recycled.reciprocal_condition(), fresh.reciprocal_condition());
    assert_eq!(recycled.log_determinant(), fresh.log_determinant());
    for n_columns in [1, 2, 70] {
        let solve = |solver: &Solver| {
            let mut columns = Mat::from_fn(1300, n_columns, |i, j| (0.1 * (i * (j + 1)) as f64).sin());
            solver.solve_in_place(columns.as_mut(), &Unobserved).unwrap();
            solver.whiten_in_place(columns.as_mut(), &Unobserved).unwrap();
            columns
        };
        assert_eq!(solve(&recycled), solve(&fresh));
    }
}

#[test]
fn the_reciprocal_condition_is_within_a_factor_three_of_the_true_one() {
    let n = 200;
    let cloud = fibonacci_sphere(n);
    for family in all_families() {
        for alpha in [1e-6, 1e-2] {
            let solver = dense(&cloud, family, 0.6, alpha);
            let mut inverse = Mat::<f64>::identity(n, n);
            solver.solve_in_place(inverse.as_mut(), &Unobserved).unwrap();
            let norm1 = (0..n).map(|j| inverse.col(j).norm_l1()).fold(0.0, f64::max);
            let ratio = solver.reciprocal_condition().unwrap() * solver.norm1() * norm1;
            assert!((1.0 - 1e-6..3.0).contains(&ratio), "{family:?}, {alpha}: {ratio}");
        }
    }
}
