use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::error::NumericsError;
use crate::kernel::{Family, Kernel};
use crate::observer::{Observer, Stage, Unobserved};
use crate::points::cloud::Cloud;
use crate::regression::function::interpolant::Interpolant;
use crate::regression::function::posterior::variances;
use crate::regression::solver::{Solver, System, expected_landmarks};
use crate::regression::sums::jets::JetOrder;
use crate::regression::sums::regularization::Regularization;
use crate::testing::{Random, fibonacci_sphere};

fn system(cloud: &Cloud, family: Family, noise: Regularization) -> System {
    System::new(Arc::new(cloud.clone()), Kernel::new(family, 0.8, 1.7).unwrap(), noise).unwrap()
}

/// Differences from the dense solver: of means, over the largest, and of variances, relative.
struct Off {
    means: f64,
    variances: f64,
    residual: f64,
}

/// Compares both solvers at places beside the points.
fn off(cloud: &Cloud, noise: &Regularization) -> Off {
    off_in(1.0, 0.0, cloud, noise)
}

fn field(cloud: &Cloud) -> Vec<f64> {
    cloud.points().map(|x| (2.0 * x[0]).sin() + x[1] * x[2]).collect()
}

/// Compares both solvers in another unit, and moved from the origin.
fn off_in(unit: f64, offset: f64, cloud: &Cloud, noise: &Regularization) -> Off {
    let values = field(cloud);
    let moved = |factor: f64, of: &Cloud| {
        Cloud::new(of.coordinates().iter().map(|x| unit * (factor * x + offset)).collect(), 3).unwrap()
    };
    let places = moved(0.97, &fibonacci_sphere(40));
    let kernel = Kernel::new(Family::Gauss, 0.8 * unit, 1.7).unwrap();
    let system = || System::new(Arc::new(moved(1.0, cloud)), kernel.clone(), noise.clone()).unwrap();
    let answers =
        [Solver::dense(system(), &Unobserved), Solver::landmark(system(), &Unobserved)].map(|solver| {
            let solver = Arc::new(solver.unwrap());
            let fitted = Interpolant::fit(solver.clone(), &values, &Unobserved).unwrap();
            let means = fitted.at(&places, JetOrder::Value, &Unobserved).unwrap().values();
            let latent = variances(&solver, &places, &Unobserved).map(|found| found.latent);
            (means, latent, fitted.solution.relative_residual)
        });
    let [(expected, expected_latent, _), (found, latent, residual)] = answers;
    let largest = expected.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
    let worst = |of: &dyn Fn(usize) -> f64| (0..places.n_points()).map(of).fold(0.0, f64::max);
    let means = worst(&|i| (found[i] - expected[i]).abs() / largest);
    let variances = match (expected_latent, latent) {
        (Ok(expected), Ok(found)) => worst(&|i| (found[i] / expected[i] - 1.0).abs()),
        // Without noise the matrix is singular to rounding, and the dense solver has no variances.
        (_, latent) => worst(&|i| -latent.as_ref().map_or(f64::INFINITY, |latent| latent[i])),
    };
    Off { means, variances, residual }
}

/// Checks means, variances and the residual.
///
/// A part 1e-8 of the noise may remain of the diagonal, and means are off by a few times that. Where the
/// noise is small, weights are rounding errors of the function divided by it: the residual of α = 1e-6 is
/// 1.3e-8, while the means agree to the last digit.
fn check(context: &str, cloud: &Cloud, noise: &Regularization) {
    let Off { means, variances, residual } = off(cloud, noise);
    assert!(means < 1e-7 && variances < 1e-5 && residual < 1e-7, "{context}: {means} {variances} {residual}");
}

#[test]
fn answers_are_those_of_the_dense_solver_whatever_the_noise() {
    let cloud = fibonacci_sphere(1500);
    for alpha in [1.0, 1e-2, 1e-4, 1e-6] {
        check(&format!("{alpha}"), &cloud, &Regularization::Uniform(alpha));
    }
    // Noise of each point its own, over four decades.
    let noise = (0..1500).map(|i| 10f64.powi(-(i % 5) - 1)).collect();
    check("many", &cloud, &Regularization::PerPoint(noise));
}

#[test]
fn exact_values_are_interpolated() {
    // The condition is beyond float64, so both solvers agree to what is left.
    let Off { means, residual, .. } = off(&fibonacci_sphere(1500), &Regularization::Uniform(1e-12));
    assert!(means < 1e-6 && residual < 1e-8, "{means} {residual}");
}

#[test]
fn clusters_and_far_points_have_landmarks_of_their_own() {
    let mut random = Random(33);
    // 1 % of the points at 100 times the density, ten far points, and repeated ones.
    let mut coordinates = fibonacci_sphere(1500).coordinates().to_vec();
    for _ in 0..15 {
        coordinates.extend([0.6, 0.8, 0.0].map(|x| x + 0.002 * random.normal()));
    }
    coordinates.extend((0..10).flat_map(|i| [5.0 + f64::from(i), 0.0, 9.0]));
    coordinates.extend_from_within(..30);
    check("clustered", &Cloud::new(coordinates, 3).unwrap(), &Regularization::Uniform(1e-3));
}

#[test]
fn large_clouds_are_completed_beyond_their_sample() {
    // 12,000 points, of which the sample leaves out a sixth, and ten far ones that it may not see.
    let mut coordinates = fibonacci_sphere(12_000).coordinates().to_vec();
    coordinates.extend((0..10).flat_map(|i| [5.0 + 3.0 * f64::from(i), 0.0, 9.0]));
    let cloud = Cloud::new(coordinates, 3).unwrap();
    let solver =
        Solver::landmark(system(&cloud, Family::Gauss, Regularization::Uniform(1e-2)), &Unobserved).unwrap();
    let remaining = solver.remaining_diagonal().unwrap();
    assert!(remaining.largest <= 4.0 * remaining.tolerance, "{remaining:?}");
    assert!(remaining.tolerance <= 1e-10 && solver.rank() < 1000, "{}", solver.rank());
}

#[test]
fn rough_kernels_are_refused() {
    let cloud = fibonacci_sphere(3000);
    let system = system(&cloud, Family::Laplace { epsilon: 0.0 }, Regularization::Uniform(1e-6));
    let refused = Solver::landmark(system, &Unobserved).map(|solver| solver.rank());
    assert_eq!(refused, Err(NumericsError::RankTooLarge { most: 1000 }));
}

#[test]
fn units_and_offsets_change_nothing() {
    let cloud = fibonacci_sphere(1200);
    for (unit, offset) in [(1e-9, 0.0), (1e8, 0.0), (1.0, 1e5), (1e-3, -700.0)] {
        let noise = Regularization::Uniform(1e-4);
        let Off { means, variances, residual } = off_in(unit, offset, &cloud, &noise);
        // Coordinates of 1e5 have lost five digits of the sphere, to both solvers alike.
        assert!(
            means < 1e-7 && variances < 1e-5 && residual < 1e-7,
            "{unit} {offset}: {means} {variances} {residual}"
        );
    }
}

#[test]
fn clusters_far_points_copies_and_exact_values_do_not_matter() {
    let sphere = fibonacci_sphere(1200);
    let mut points = sphere.coordinates().to_vec();
    points.extend(fibonacci_sphere(100).points().flat_map(|x| [1.0 + 0.01 * x[0], 0.01 * x[1], 0.01 * x[2]]));
    points.extend((0..10).flat_map(|i| [20.0 + f64::from(i), 0.0, 3.0 * f64::from(i)]));
    points.extend_from_slice(&sphere.coordinates()[..30]);
    let cloud = Cloud::new(points, 3).unwrap();
    check("noise", &cloud, &Regularization::Uniform(1e-4));
    // One of each two copies has noise.
    let exact = |i: usize| i % 50 == 40 && i < 1200;
    let noise = (0..cloud.n_points()).map(|i| if exact(i) { 0.0 } else { 1e-4 }).collect();
    check("exact", &cloud, &Regularization::PerPoint(noise));
}

#[test]
fn whichever_points_are_looked_at_first_the_function_is_the_same() {
    let cloud = fibonacci_sphere(10_500);
    let (values, places) = (field(&cloud), fibonacci_sphere(40));
    let means = |seed: usize| {
        // Landmarks are chosen among 10,000 of the points.
        let order: Vec<usize> =
            (0..10_500).map(|i| (i * [1, 11, 13, 17, 19][seed] + 101 * seed) % 10_500).collect();
        let system = system(&cloud.select(&order), Family::Gauss, Regularization::Uniform(1e-4));
        let solver = Arc::new(Solver::landmark(system, &Unobserved).unwrap());
        let values: Vec<f64> = order.iter().map(|&point| values[point]).collect();
        let fitted = Interpolant::fit(solver, &values, &Unobserved).unwrap();
        fitted.at(&places, JetOrder::Value, &Unobserved).unwrap().values()
    };
    let first = means(0);
    for seed in 1..5 {
        assert!(means(seed).iter().zip(&first).all(|(a, b)| (a - b).abs() < 1e-8), "{seed}");
    }
}

#[test]
fn the_condition_is_that_of_the_dense_solver() {
    for (cloud, alpha) in
        [(fibonacci_sphere(1500), 1e-2), (fibonacci_sphere(1500), 1e-8), (fibonacci_sphere(150), 1e-3)]
    {
        let system = || system(&cloud, Family::Gauss, Regularization::Uniform(alpha));
        let solvers = [Solver::dense(system(), &Unobserved), Solver::landmark(system(), &Unobserved)];
        let [expected, found] = solvers.map(|solver| solver.unwrap().reciprocal_condition().unwrap());
        assert!((0.2..5.0).contains(&(found / expected)), "α = {alpha}: {found:e}, {expected:e}");
    }
}

#[test]
fn a_few_hundred_points_tell_how_many_landmarks_all_need() {
    let torus = torus(2_500);
    let noise = Regularization::Uniform(1e-2);
    for (cloud, family, length_scale) in [
        (fibonacci_sphere(2_500), Family::Gauss, 0.8),
        (torus.clone(), Family::Gauss, 1.75),
        (torus.clone(), Family::InverseMultiquadric, 8.0),
        (torus.clone(), Family::Matern { order: 8 }, 6.0),
        (line(2_500), Family::Gauss, 0.02),
        (in_two_places(&fibonacci_sphere(1_250)), Family::Gauss, 1.5),
    ] {
        let kernel = Kernel::new(family, length_scale, 1.7).unwrap();
        let expected = expected_landmarks(&cloud, &kernel, &noise, 500, &Unobserved).unwrap().unwrap();
        let system = System::new(Arc::new(cloud), kernel, noise.clone()).unwrap();
        let needed = Solver::landmark(system, &Unobserved).unwrap().rank();
        let ratio = expected as f64 / needed as f64;
        assert!((0.75..1.25).contains(&ratio), "{family:?} {length_scale}: {expected}, {needed}");
    }
    for (family, length_scale) in
        [(Family::Matern { order: 2 }, 0.3), (Family::Gauss, 0.2), (Family::Laplace { epsilon: 0.0 }, 2.0)]
    {
        let kernel = Kernel::new(family, length_scale, 1.7).unwrap();
        assert_eq!(
            expected_landmarks(&torus, &kernel, &noise, 500, &Unobserved).unwrap(),
            None,
            "{family:?}"
        );
    }
}

/// Counts checkpoints, of which each follows a block of pivots.
#[derive(Default)]
struct CheckpointCounter(AtomicUsize);

impl Observer for CheckpointCounter {
    fn enter(&self, _: Stage) {}

    fn is_cancelled(&self) -> bool {
        self.0.fetch_add(1, Ordering::Relaxed);
        false
    }
}

#[test]
fn a_rough_kernel_is_given_up_after_a_block_of_pivots() {
    let (torus, noise) = (torus(2_500), Regularization::Uniform(1e-2));
    let n_checkpoints = |length_scale: f64, family: Family| {
        let kernel = Kernel::new(family, length_scale, 1.0).unwrap();
        let counted = CheckpointCounter::default();
        expected_landmarks(&torus, &kernel, &noise, 500, &counted).unwrap();
        counted.0.into_inner()
    };
    let (smooth, rough) =
        (n_checkpoints(1.75, Family::Gauss), n_checkpoints(0.3, Family::Matern { order: 2 }));
    assert!(2 * rough < smooth, "{rough} of {smooth} checkpoints");
}

/// Points of the unit interval, in their order.
fn line(n: usize) -> Cloud {
    Cloud::new((0..n).map(|i| i as f64 / n as f64).collect(), 1).unwrap()
}

/// A cloud, and the same far away.
fn in_two_places(cloud: &Cloud) -> Cloud {
    let moved = cloud.coordinates().iter().map(|x| x + 100.0);
    Cloud::new(cloud.coordinates().iter().copied().chain(moved).collect(), 3).unwrap()
}

/// Random points of a torus of radii 2 and ½.
fn torus(n: usize) -> Cloud {
    let mut random = Random(7);
    let point = |_| {
        let [u, v] = [(); 2].map(|()| std::f64::consts::TAU * random.uniform());
        [(2.0 + 0.5 * v.cos()) * u.cos(), (2.0 + 0.5 * v.cos()) * u.sin(), 0.5 * v.sin()]
    };
    Cloud::new((0..n).flat_map(point).collect(), 3).unwrap()
}
