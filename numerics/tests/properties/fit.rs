//! Fits: interpolation, the proposition on regularization, derivatives, and the Gaussian process.

use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::regression::function::posterior::{covariance, log_marginal_likelihood, variances};
use gramian_numerics::regression::solver::{Method, Solver};
use gramian_numerics::regression::sums::jets::{JetOrder, Jets};

use crate::common::clouds::{fibonacci_sphere, random_cube, waves};
use crate::common::fits::{factorize, fit};
use crate::common::random::Random;
use crate::support::{
    EPS, cholesky, cross_gram, distance, dot, families, forward_solve, kernel, largest, rounding, shifted,
};

fn jets(u: &Interpolant, queries: &Cloud, order: JetOrder) -> Jets {
    u.at(queries, order, &Unobserved).unwrap()
}

fn absolute_sum(weights: &[f64]) -> f64 {
    weights.iter().map(|w| w.abs()).sum()
}

#[test]
fn without_regularization_the_fit_interpolates() {
    // The scattered points on a line drive the smooth kernels into the fallback.
    // Those in R⁴ exclude Wendland.
    let line = (random_cube(20, 1, &mut Random(2)), 0.7);
    for (cloud, length_scale) in [
        (fibonacci_sphere(150), 1.0),
        (random_cube(80, 2, &mut Random(1)), 0.7),
        line,
        (random_cube(60, 4, &mut Random(3)), 1.2),
    ] {
        let values = waves(&cloud);
        for kernel in families().into_iter().map(|family| kernel(family, length_scale)) {
            if kernel.check_dimension(cloud.dimension()).is_err() {
                continue;
            }
            let factor = factorize(&cloud, kernel.clone(), 0.0);
            let u = fit(&factor, &values);
            let error = distance(&jets(&u, &cloud, JetOrder::Value).values(), &values);
            // Cholesky is backward stable: n ε k₀ Σ|λ|. The fallback drops directions
            // of power below √(64 ε k₀).
            let solved = cloud.n_points() as f64 * EPS * kernel.at_zero() * absolute_sum(&u.solution.weights);
            let left_out = match factor.method() {
                Method::Cholesky => 0.0,
                Method::PivotedCholesky | Method::Landmark | Method::ConjugateGradients => {
                    (64.0 * EPS * kernel.at_zero() * u.solution.native_norm_squared).sqrt()
                }
            };
            let tolerance = solved + left_out;
            assert!(error <= tolerance, "{kernel:?}: {error:e} against {tolerance:e}");
            assert!(u.solution.misfit <= tolerance * (cloud.n_points() as f64).sqrt(), "{kernel:?}");
        }
    }
}

#[test]
fn a_growing_alpha_lowers_the_norm_and_raises_the_misfit() {
    let cloud = fibonacci_sphere(40);
    let values = waves(&cloud);
    for family in families() {
        let norms_and_misfits: Vec<(f64, f64)> = (-6..4)
            .map(|decade| fit(&factorize(&cloud, kernel(family, 1.0), 10f64.powi(decade)), &values).solution)
            .map(|solution| (solution.native_norm_squared, solution.misfit))
            .collect();
        for pair in norms_and_misfits.windows(2) {
            assert!(pair[1].0 < pair[0].0, "{family:?}: norms {} then {}", pair[0].0, pair[1].0);
            assert!(pair[1].1 > pair[0].1, "{family:?}: misfits {} then {}", pair[0].1, pair[1].1);
        }
    }
}

#[test]
fn the_loss_of_norm_is_the_distance_plus_twice_the_misfit_over_alpha() {
    // errata.md, 10: ‖u⁰‖² − ‖u^α‖² = ‖u⁰ − u^α‖² + (2/α)|u^α(X) − Y|².
    let cloud = fibonacci_sphere(40);
    let values = waves(&cloud);
    for family in families() {
        let kernel = kernel(family, 1.0);
        let gram = cross_gram(&cloud, &kernel, &cloud);
        let exact = factorize(&cloud, kernel.clone(), 0.0);
        let interpolant = fit(&exact, &values).solution;
        for decade in -6..4 {
            let alpha = 10f64.powi(decade);
            let smoothed = fit(&factorize(&cloud, kernel.clone(), alpha), &values).solution;
            let pairs = interpolant.weights.iter().zip(&smoothed.weights);
            let difference: Vec<f64> = pairs.map(|(a, b)| a - b).collect();
            let distance = dot(&difference, &times(&gram, &difference));
            let lost = interpolant.native_norm_squared - smoothed.native_norm_squared;
            let error = lost - distance - 2.0 / alpha * smoothed.misfit.powi(2);
            // Weights are right to n ε cond, and each of the terms is at most 2‖u⁰‖².
            let tolerance = 4.0 * rounding(&exact) * interpolant.native_norm_squared;
            assert!(error.abs() <= tolerance, "{family:?} alpha {alpha:e}: {error:e} against {tolerance:e}");
        }
    }
}

#[test]
fn derivatives_agree_with_central_differences_off_the_cloud() {
    // Off the cloud kernels with a kink are smooth as well.
    let (cloud, queries, h) = (fibonacci_sphere(60), random_cube(15, 3, &mut Random(4)), 1e-5);
    let values = waves(&cloud);
    for family in families() {
        let u = fit(&factorize(&cloud, kernel(family, 1.1), 1e-4), &values);
        let here = jets(&u, &queries, JetOrder::Hessian);
        // Truncation is h²/6 times a derivative of order at most 4. This is at most 1e3 for √ε = 0.1 and at
        // this distance from the kinks. Rounding, ε/h, is far below.
        let tolerance = 200.0 * h * h * u.solver.kernel().at_zero() * absolute_sum(&u.solution.weights);
        for axis in 0..3 {
            let below = jets(&u, &shifted(&queries, axis, -h), JetOrder::Gradient);
            let above = jets(&u, &shifted(&queries, axis, h), JetOrder::Gradient);
            for query in 0..queries.n_points() {
                let slope = (above.value(query) - below.value(query)) / (2.0 * h);
                let error = (slope - here.gradient(query)[axis]).abs();
                assert!(error <= tolerance, "{family:?}: {error:e} against {tolerance:e}");
                let gradients = above.gradient(query).iter().zip(below.gradient(query));
                let bends: Vec<f64> = gradients.map(|(a, b)| (a - b) / (2.0 * h)).collect();
                let error = distance(&bends, &here.hessian(query)[axis * 3..][..3]);
                assert!(error <= tolerance, "{family:?}: Hessian {error:e} against {tolerance:e}");
            }
        }
    }
}

#[test]
fn the_posterior_and_its_likelihood_are_those_of_a_direct_computation() {
    let (cloud, queries) = (random_cube(12, 2, &mut Random(5)), random_cube(9, 2, &mut Random(6)));
    let values = waves(&cloud);
    for (family, alpha) in families().into_iter().flat_map(|family| [(family, 0.0), (family, 1e-2)]) {
        let factor = factorize(&cloud, kernel(family, 0.5), alpha);
        let kernel = factor.kernel().clone();
        let mut gram = cross_gram(&cloud, &kernel, &cloud);
        gram.iter_mut().step_by(13).for_each(|diagonal| *diagonal += alpha);
        let lower = cholesky(&gram).unwrap();
        let whitened_values = forward_solve(&lower, &values);
        let log_determinant: f64 = (0..12).map(|i| 2.0 * lower[i * 13].ln()).sum();
        let normalization = 12.0 * (2.0 * std::f64::consts::PI).ln();
        let quadratic = dot(&whitened_values, &whitened_values);
        let expected = -0.5 * (quadratic + log_determinant + normalization);
        let solution = fit(&factor, &values).solution;
        let found = log_marginal_likelihood(&factor, &solution, 1.0).unwrap();
        // Both factors are off by n ε cond relative to the matrices that they factorize.
        let tolerance = rounding(&factor);
        let error = (found - expected).abs();
        assert!(error <= tolerance * (quadratic + 12.0), "{family:?}: likelihood {found} not {expected}");

        let cross = cross_gram(&cloud, &kernel, &queries);
        let whitened: Vec<Vec<f64>> = cross.chunks(12).map(|column| forward_solve(&lower, column)).collect();
        let prior = cross_gram(&queries, &kernel, &queries);
        let expected: Vec<f64> =
            (0..81).map(|at| prior[at] - dot(&whitened[at / 9], &whitened[at % 9])).collect();
        let error = distance(&covariance(&factor, &queries, &Unobserved).unwrap().latent, &expected);
        assert!(error <= tolerance * kernel.at_zero(), "{family:?}: covariance off by {error:e}");
    }
}

#[test]
fn covariances_are_symmetric_and_positive_semidefinite_with_the_variances_on_the_diagonal() {
    let (cloud, queries) = (fibonacci_sphere(50), random_cube(20, 3, &mut Random(7)));
    for family in families() {
        let factor = factorize(&cloud, kernel(family, 1.0), 1e-6);
        let found = covariance(&factor, &queries, &Unobserved).unwrap().latent;
        let mut lifted = found.clone();
        // The smallest eigenvalues may turn negative by the rounding of k₀ − |L⁻¹k|², n ε cond.
        let tolerance = rounding(&factor) * factor.kernel().at_zero();
        lifted.iter_mut().step_by(21).for_each(|diagonal| *diagonal += tolerance);
        assert!(cholesky(&lifted).is_some(), "{family:?}: not positive semidefinite");
        let transposed = |at: usize| found[at % 20 * 20 + at / 20];
        assert!((0..400).all(|at| found[at] == transposed(at)), "{family:?}: not symmetric");
        let diagonal: Vec<f64> = found.iter().copied().step_by(21).collect();
        assert!(distance(&diagonal, &latent(&factor, &queries)) <= tolerance, "{family:?}");
    }
}

#[test]
fn variances_lie_between_zero_and_the_prior_and_fall_with_every_point() {
    let (all, queries) = (random_cube(24, 2, &mut Random(8)), random_cube(30, 2, &mut Random(9)));
    for family in families() {
        let kernel = kernel(family, 0.8);
        let mut before = vec![kernel.at_zero(); 30];
        for n in 1..=24 {
            let cloud = Cloud::new(all.coordinates()[..2 * n].to_vec(), 2).unwrap();
            let factor = factorize(&cloud, kernel.clone(), 1e-4);
            let now = latent(&factor, &queries);
            assert!(now.iter().all(|&variance| variance >= 0.0), "{family:?}");
            // In exact arithmetic no variance grows. φ(0) itself is right to 4 ε.
            let tolerance = kernel.at_zero() * (4.0 * EPS + rounding(&factor));
            let growth = now.iter().zip(&before).map(|(now, before)| now - before).fold(0.0, f64::max);
            assert!(growth <= tolerance, "{family:?}: {growth:e} at {n} points");
            before = now;
        }
        // Some queries lie within ℓ/4 of a point: their variance has fallen by at least a tenth.
        assert!(before.iter().any(|&variance| variance < 0.9 * kernel.at_zero()), "{family:?}");
        assert!(largest(latent(&factorize(&all, kernel.clone(), 0.0), &all)) <= 1e-9 * kernel.at_zero());
    }
}

fn latent(factor: &Solver, queries: &Cloud) -> Vec<f64> {
    variances(factor, queries, &Unobserved).unwrap().latent
}

fn times(matrix: &[f64], x: &[f64]) -> Vec<f64> {
    matrix.chunks(x.len()).map(|row| dot(row, x)).collect()
}
