//! Curvatures and the Laplace–Beltrami operator with default parameters.

use gramian_numerics::kernel::defaults::Purpose;
use gramian_numerics::observer::Unobserved;
use gramian_numerics::operators::Operator;
use gramian_numerics::points::cloud::Cloud;

use crate::common::clouds::{fibonacci_sphere, random_sphere, random_torus};
use crate::common::fits::fit;
use crate::common::random::Random;
use crate::support::{factor, geometry, quantile};

/// Errors of the principal curvatures at every point, relative to the larger exact one.
fn errors(cloud: &Cloud, exact: impl Fn(&[f64]) -> [f64; 2]) -> Vec<f64> {
    let geometry = geometry(cloud, Purpose::Curvatures);
    assert!(geometry.is_null().iter().all(|is_null| !is_null));
    let principal = geometry.curvatures(&Unobserved).unwrap().principal;
    let error = |(found, x): (&[f64], &[f64])| {
        let exact = exact(x);
        (found[0] - exact[0]).abs().max((found[1] - exact[1]).abs()) / exact[1].abs().max(exact[0].abs())
    };
    principal.chunks_exact(2).zip(cloud.points()).map(error).collect()
}

#[test]
fn curvatures_of_spheres_and_tori_are_right_to_a_few_percent() {
    let torus = |x: &[f64]| {
        let rho = x[0].hypot(x[1]);
        [(rho - 2.0) / 0.5 / rho, 2.0]
    };
    for seed in 0..3 {
        let clouds = [
            ("random sphere", errors(&random_sphere(1000, &mut Random(seed)), |_| [1.0, 1.0])),
            ("regular sphere", errors(&fibonacci_sphere(1000), |_| [1.0, 1.0])),
            ("random torus", errors(&random_torus(1000, &mut Random(seed)), torus)),
        ];
        for (name, errors) in clouds {
            let (median, p95) = (quantile(&errors, 0.5), quantile(&errors, 0.95));
            println!("{name}: median {median:.4}, 95 % {p95:.4}");
            assert!(median <= 0.05 && p95 <= 0.25, "{name}, seed {seed}: {median}, {p95}");
        }
    }
}

#[test]
fn the_laplacian_of_a_coordinate_of_the_sphere_is_minus_twice_it() {
    let random = |n: usize, seed: u64| random_sphere(n, &mut Random(seed));
    for cloud in [random(1000, 5), fibonacci_sphere(1000), random(300, 6)] {
        let geometry = geometry(&cloud, Purpose::Curvatures);
        let values: Vec<f64> = cloud.points().map(|x| x[2]).collect();
        let u = fit(&factor(&cloud, Purpose::Values), &values);
        let found = Operator::LaplaceBeltrami.apply(&geometry, &u, &cloud, &Unobserved).unwrap();
        let worst = found.iter().zip(&values).map(|(f, z)| (f + 2.0 * z).abs() / 2.0).fold(0.0, f64::max);
        println!("Laplacian of a coordinate: worst {worst:.4} of its maximum");
        assert!(worst <= 0.05, "{worst}");
    }
}
