//! The local solver against the dense one where neighbours are not all points: it has an error, and that is held to the deviation
//! that the posterior has there anyway.

use std::sync::Arc;

use gramian::numerics::function::interpolant::Interpolant;
use gramian::numerics::function::moving::{Moving, MovingRequest};
use gramian::numerics::function::posterior::variances;
use gramian::numerics::kernel::{Family, Kernel};
use gramian::numerics::observer::Unobserved;
use gramian::numerics::points::cloud::Cloud;
use gramian::numerics::points::sampling::Sampling;
use gramian::numerics::solver::{Solver, System};
use gramian::numerics::sums::jets::JetOrder;
use gramian::numerics::sums::regularization::Regularization;

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
        let request = MovingRequest { order: JetOrder::Gradient, has_variances: true, has_deviations: false };
        let found = Moving::new(system(), sampling.clone(), &Unobserved)
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
        // Fewer observations say less.
        assert!((0..m).all(|q| latent[q] >= deviations[q].powi(2) * (1.0 - 1e-9)), "{family:?}");
        assert_eq!(found.n_dependent, 0);
    }
}
