//! Clouds far from the origin, tiny and huge ones: only coordinate differences relative to ℓ matter.

use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::operators::Operator;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::function::posterior::variances;

use crate::support::*;

const N: usize = 120;

/// All answers of a fit, one list each, with the power of the length unit in which each is measured.
fn answers(
    points: &Cloud,
    queries: &Cloud,
    kernel: Kernel,
    alpha: f64,
    values: &[f64],
) -> [(Vec<f64>, i32); 9] {
    let factor = factorize(points, kernel, alpha);
    let u = fit(&factor, values);
    let geometry = geometry(&factor, queries);
    let curvatures = geometry.curvatures(&Unobserved).unwrap();
    let [value, gradient, laplacian] = jets(&u, queries);
    [
        (u.solution.weights.clone(), 0),
        (value, 0),
        (gradient, -1),
        (laplacian, -2),
        (geometry.normals().to_vec(), 0),
        (curvatures.principal, -1),
        (Operator::SurfaceGradient.apply(&geometry, &u, queries, &Unobserved).unwrap(), -1),
        (Operator::LaplaceBeltrami.apply(&geometry, &u, queries, &Unobserved).unwrap(), -2),
        (variances(&factor, queries, &Unobserved).unwrap().latent, 0),
    ]
}

fn mapped(cloud: &Cloud, f: impl Fn(f64) -> f64) -> Cloud {
    Cloud::new(cloud.coordinates().iter().map(|&x| f(x)).collect(), cloud.dimension()).unwrap()
}

/// Kernels that Cholesky handles and, at α = 0, one that needs the fallback: family, ℓ and α.
fn cases() -> impl Iterator<Item = (Family, f64, f64)> {
    FAMILIES.into_iter().filter(|&family| !kernel(family, 1.0).has_kink()).flat_map(|family| {
        let length_scale = if matches!(family, Family::Wendland { .. }) { 2.0 } else { 0.6 };
        [0.0, 1e-6].map(|alpha| (family, length_scale, alpha))
    })
}

#[test]
fn a_cloud_at_a_million_is_answered_as_at_the_origin() {
    // Rounding moves coordinates near 1e6 by up to 6e-11. Both clouds are made of the rounded
    // coordinates, which are multiples of 2^-33 below 2^21. Their differences are exact in float64, so
    // the answers agree in every bit.
    let (points, queries) = (fibonacci_sphere(N), around_sphere(15, 5));
    let values = waves(&points);
    let far = [&points, &queries].map(|cloud| mapped(cloud, |x| x + 1e6));
    let near = [&far[0], &far[1]].map(|cloud| mapped(cloud, |x| x - 1e6));
    assert_ne!(near[0], points);
    for (family, length_scale, alpha) in cases() {
        let kernel = kernel(family, length_scale);
        let found = answers(&far[0], &far[1], kernel.clone(), alpha, &values);
        let expected = answers(&near[0], &near[1], kernel.clone(), alpha, &values);
        for (index, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert_eq!(found, expected, "{family:?}, α = {alpha}, answer {index}");
        }
    }
}

#[test]
fn powers_of_two_as_unit_change_nothing() {
    // Scaling by a power of two is exact in float64, and so is everything computed from it.
    let (points, queries) = (fibonacci_sphere(N), around_sphere(15, 6));
    let values = waves(&points);
    for (family, length_scale, alpha) in cases() {
        let expected = answers(&points, &queries, kernel(family, length_scale), alpha, &values);
        for exponent in [-20, 20] {
            let unit = 2f64.powi(exponent);
            let scaled = [&points, &queries].map(|cloud| mapped(cloud, |x| x * unit));
            let found = answers(&scaled[0], &scaled[1], kernel(family, length_scale * unit), alpha, &values);
            for (index, ((found, power), (expected, _))) in found.iter().zip(&expected).enumerate() {
                let back: Vec<f64> = found.iter().map(|x| x / unit.powi(*power)).collect();
                assert_eq!(&back, expected, "{family:?}, α = {alpha}, 2^{exponent}, answer {index}");
            }
        }
    }
}

#[test]
fn any_unit_from_a_millionth_to_a_million_changes_rounding_alone() {
    let (points, queries) = (fibonacci_sphere(N), around_sphere(15, 7));
    let values = waves(&points);
    // With α = 1e-6 the condition is at most ‖K‖₁/α = 1e8. Rounding of the coordinates moves entries of K by
    // a few ε. Weights move by n ε times the condition, and sums over them by no more. Derivatives lose two
    // further digits, hence the factor 100.
    for (family, length_scale, alpha) in cases().filter(|case| case.2 > 0.0) {
        let expected = answers(&points, &queries, kernel(family, length_scale), alpha, &values);
        let condition =
            1.0 / factorize(&points, kernel(family, length_scale), alpha).reciprocal_condition().unwrap();
        let tolerance = 100.0 * N as f64 * EPS * condition;
        for unit in [1e-6, 1e-3, 1e3, 1e6] {
            let scaled = [&points, &queries].map(|cloud| mapped(cloud, |x| x * unit));
            let found = answers(&scaled[0], &scaled[1], kernel(family, length_scale * unit), alpha, &values);
            for (index, ((found, power), (expected, _))) in found.iter().zip(&expected).enumerate() {
                let back: Vec<f64> = found.iter().map(|x| x / unit.powi(*power)).collect();
                let error = relative_distance(&back, expected);
                assert!(
                    error < tolerance,
                    "{family:?}, unit {unit:e}, answer {index}: {error:e} of {tolerance:e}"
                );
            }
        }
    }
}
