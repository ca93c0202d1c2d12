//! Curvatures and the Laplace–Beltrami operator with no parameters.

use std::f64::consts::PI;
use std::sync::Arc;

use gramian::numerics::defaults::Purpose;
use gramian::numerics::function::interpolant::Interpolant;
use gramian::numerics::observer::Unobserved;
use gramian::numerics::points::cloud::Cloud;
use gramian::numerics::surface::operators::laplace_beltrami;

use super::support::{Random, factor, geometry, quantile};

fn random_sphere(n: usize, seed: u64) -> Vec<f64> {
    let mut random = Random(seed);
    let point = |_| {
        let (z, t) = (2.0 * random.uniform() - 1.0, 2.0 * PI * random.uniform());
        let r = (1.0 - z * z).sqrt();
        [r * t.cos(), r * t.sin(), z]
    };
    (0..n).flat_map(point).collect()
}

fn fibonacci_sphere(n: usize) -> Vec<f64> {
    let point = |i: usize| {
        let (z, t) = (1.0 - (2 * i + 1) as f64 / n as f64, PI * (1.0 + 5f64.sqrt()) * i as f64);
        let r = (1.0 - z * z).sqrt();
        [r * t.cos(), r * t.sin(), z]
    };
    (0..n).flat_map(point).collect()
}

/// Uniform in area on the torus with R₁ = 2, R₂ = ½, by rejection.
fn random_torus(n: usize, seed: u64) -> Vec<f64> {
    let mut random = Random(seed);
    let mut points = Vec::with_capacity(3 * n);
    while points.len() < 3 * n {
        let (u, v) = (2.0 * PI * random.uniform(), 2.0 * PI * random.uniform());
        let rho = 2.0 + 0.5 * v.cos();
        if random.uniform() * 2.5 < rho {
            points.extend([rho * u.cos(), rho * u.sin(), 0.5 * v.sin()]);
        }
    }
    points
}

/// Errors of the principal curvatures against the larger exact one, at every point.
fn errors(points: Vec<f64>, exact: impl Fn(&[f64]) -> [f64; 2]) -> Vec<f64> {
    let cloud = Arc::new(Cloud::new(points, 3).unwrap());
    let (_, geometry) = geometry(&cloud, Purpose::Curvatures);
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
            ("random sphere", errors(random_sphere(1000, seed), |_| [1.0, 1.0])),
            ("regular sphere", errors(fibonacci_sphere(1000), |_| [1.0, 1.0])),
            ("random torus", errors(random_torus(1000, seed), torus)),
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
    for points in [random_sphere(1000, 5), fibonacci_sphere(1000), random_sphere(300, 6)] {
        let cloud = Arc::new(Cloud::new(points, 3).unwrap());
        let (_, geometry) = geometry(&cloud, Purpose::Curvatures);
        let values: Vec<f64> = cloud.points().map(|x| x[2]).collect();
        let u = Interpolant::fit(factor(&cloud, Purpose::Values), &values, &Unobserved).unwrap();
        let found = laplace_beltrami(&geometry, &u, &cloud, &Unobserved).unwrap();
        let worst = found.iter().zip(&values).map(|(f, z)| (f + 2.0 * z).abs() / 2.0).fold(0.0, f64::max);
        println!("Laplacian of a coordinate: worst {worst:.4} of its maximum");
        assert!(worst <= 0.05, "{worst}");
    }
}
