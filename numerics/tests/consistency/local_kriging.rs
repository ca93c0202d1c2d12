//! The local solver against the dense one where neighbours are only some of the points. Its error must be
//! small against the deviation that the posterior has anyway.

use std::sync::Arc;

use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::regression::function::deviations::JetDeviations;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::regression::function::local_kriging::{KrigingRequest, LocalKriging};
use gramian_numerics::regression::function::posterior::variances;
use gramian_numerics::regression::selection::{Noise, ObservedCloud, learn_mean};
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::regression::solver::{Solver, System};
use gramian_numerics::regression::sums::jets::JetOrder;
use gramian_numerics::regression::sums::regularization::Regularization;

use crate::common::clouds::random_cube;
use crate::common::random::Random;

const N_POINTS: usize = 2000;

/// Root mean square.
fn rms(numbers: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = numbers.fold((0.0, 0.0), |(sum, n), x| (sum + x * x, n + 1.0));
    (sum / n).sqrt()
}

/// Noisy values of a function with detail on the scale of the kernel, at points of the cube.
fn noisy_values(cloud: &Cloud, noise: f64, random: &mut Random) -> Vec<f64> {
    let value = |x: &[f64]| (5.0 * x[0] + 2.0 * x[1]).sin() + (4.0 * x[1] * x[2]).cos();
    cloud.points().map(|x| value(x) + noise * random.normal()).collect()
}

#[test]
fn kriging_from_128_neighbours_is_off_by_little_of_the_dense_deviation() {
    let mut random = Random(11);
    let cloud = Arc::new(random_cube(N_POINTS, 3, &mut random));
    let queries = random_cube(400, 3, &mut random);
    let values = noisy_values(&cloud, 0.01, &mut random);
    let sampling = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
    for (family, tolerance) in [(Family::Matern { order: 1 }, 0.06), (Family::Matern { order: 2 }, 0.08)] {
        let kernel = Kernel::new(family, 0.6, 1.0).unwrap();
        let system = || System::new(cloud.clone(), kernel.clone(), Regularization::Uniform(1e-4)).unwrap();
        let solver = Arc::new(Solver::dense(system(), &Unobserved).unwrap());
        let dense = Interpolant::fit(solver.clone(), &values, &Unobserved).unwrap();
        let dense = dense.at(&queries, JetOrder::Gradient, &Unobserved).unwrap();
        let deviations: Vec<f64> =
            variances(&solver, &queries, &Unobserved).unwrap().latent.iter().map(|v| v.sqrt()).collect();
        let request = KrigingRequest {
            order: JetOrder::Gradient,
            has_variances: true,
            has_deviations: false,
            trend: None,
        };
        let found = LocalKriging::new(system(), sampling.clone(), &Unobserved)
            .unwrap()
            .at(&values, &queries, request, &Unobserved)
            .unwrap();
        let m = queries.n_points();
        let means = rms((0..m).map(|q| (found.jets.value(q) - dense.value(q)) / deviations[q]));
        let latent = found.variances.unwrap().latent;
        let widths = rms((0..m).map(|q| latent[q].sqrt() / deviations[q] - 1.0));
        let slopes = rms((0..m).map(|q| found.jets.gradient(q)[0] - dense.gradient(q)[0]))
            / rms((0..m).map(|q| dense.gradient(q)[0]));
        eprintln!("{family:?}: means {means:.4}, deviations {widths:.4}, gradients {slopes:.4}");
        assert!(means < tolerance, "{family:?}: means are off by {means} deviations");
        assert!(widths < 0.01, "{family:?}: deviations by {widths}");
        assert!(slopes < 0.03, "{family:?}: gradients by {slopes}");
        // Fewer observations leave a larger variance.
        assert!((0..m).all(|q| latent[q] >= deviations[q].powi(2) * (1.0 - 1e-9)), "{family:?}");
        assert_eq!(found.n_dependent, 0);
    }
}

#[test]
fn what_is_not_known_of_the_mean_counts_as_in_the_dense_posterior() {
    let mut random = Random(12);
    // A neighbourhood holds at least as many points as the cloud, so both posteriors
    // condition on the same values.
    let cloud = Arc::new(random_cube(100, 3, &mut random));
    let values = noisy_values(&cloud, 0.1, &mut random);
    // Queries among the points, and one so far away that only the mean is left.
    let mut queries = random_cube(20, 3, &mut random).coordinates().to_vec();
    queries.extend([9.0, -7.0, 8.0]);
    let queries = Cloud::new(queries, 3).unwrap();
    let kernel = Kernel::new(Family::Matern { order: 2 }, 0.5, 1.7).unwrap();
    let system = || System::new(cloud.clone(), kernel.clone(), Regularization::Uniform(0.01)).unwrap();
    let solver = Arc::new(Solver::dense(system(), &Unobserved).unwrap());
    let sampling = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
    let moving = LocalKriging::new(system(), sampling.clone(), &Unobserved).unwrap();
    for mean in [Mean::Constant, Mean::Linear] {
        let noise = Noise::Uniform(0.01);
        let observed = ObservedCloud { cloud: &cloud, sampling: &sampling, values: &values, noise, mean };
        let trend = learn_mean(observed, &kernel, &Unobserved).unwrap().trend;
        let request = KrigingRequest {
            order: JetOrder::Hessian,
            has_variances: false,
            has_deviations: true,
            trend: trend.as_ref(),
        };
        let found = moving.at(&values, &queries, request, &Unobserved).unwrap();
        let dense = Interpolant::fit_with_mean(solver.clone(), &values, mean, &Unobserved).unwrap();
        let bars = JetDeviations::of(&dense, 1.0, &queries, 2, &Unobserved).unwrap();
        let jets = dense.at(&queries, JetOrder::Hessian, &Unobserved).unwrap();
        let near = |found: &[f64], expected: &[f64]| {
            // Both solvers lose some digits where a variance is a small difference.
            assert_eq!(found.len(), expected.len());
            for (found, expected) in found.iter().zip(expected) {
                assert!(
                    (found - expected).abs() < 1e-8 * (1.0 + expected.abs()),
                    "{mean:?}: {found} {expected}"
                );
            }
        };
        near(&found.jets.values(), &jets.values());
        near(&found.jets.gradients(), &jets.gradients());
        let deviations = found.deviations.unwrap();
        near(&deviations.values, &bars.values);
        near(&deviations.gradients, &bars.gradients);
        near(&deviations.hessians, &bars.hessians);
        // With a known mean the deviation far away would be that of the process. The unknown mean adds to it.
        assert!(deviations.values[20] > 1.01 * 1.7f64.sqrt(), "{mean:?}");
    }
}
