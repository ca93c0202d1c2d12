//! Kernels with a length scale for each axis: those of a stretched cloud, with derivatives by the chain rule.

use std::sync::Arc;

use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::operators::Operator;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::regression::function::deviations::JetDeviations;
use gramian_numerics::regression::function::local_kriging::{KrigingRequest, LocalKriging};
use gramian_numerics::regression::function::posterior::{covariance, variances};
use gramian_numerics::regression::solver::System;
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::regression::sums::jets::{JetOrder, Jets};
use gramian_numerics::regression::sums::regularization::Regularization;

use crate::common::clouds::{fibonacci_sphere, random_cube, stretched, waves};
use crate::common::fits::{factorize, fit, geometry};
use crate::common::random::Random;
use crate::support::{distance, families, families_without_kink, kernel, largest, norm, rounding};

/// Length scales that are powers of two, as are the factors ℓ/ℓ_c: stretching rounds nothing.
const LENGTH_SCALES: [f64; 3] = [1.0, 4.0, 0.5];
const FACTORS: [f64; 3] = [0.5, 0.125, 1.0];

fn of_axes(family: Family) -> Kernel {
    Kernel::of_axes(family, &LENGTH_SCALES, 1.7).unwrap()
}

fn of_one(family: Family) -> Kernel {
    Kernel::new(family, 0.5, 1.7).unwrap()
}

/// Gradients and Hessians in coordinates from those in stretched coordinates, query by query.
fn by_chain_rule(jets: &Jets) -> (Vec<f64>, Vec<f64>) {
    let gradients = jets.gradients().iter().enumerate().map(|(at, g)| g * FACTORS[at % 3]).collect();
    let factor = |at: usize| FACTORS[at / 3 % 3] * FACTORS[at % 3];
    (gradients, jets.hessians().iter().enumerate().map(|(at, h)| h * factor(at)).collect())
}

fn are_equal(found: &[f64], expected: &[f64], family: Family, what: &str) {
    let scale = largest(expected.iter().map(|x| x.abs()));
    let apart = distance(found, expected);
    assert_eq!(found.len(), expected.len());
    assert!(apart <= 1e-13 * scale, "{family:?}, {what}: {apart:e} of {scale:e}");
}

#[test]
fn functions_and_their_error_bars_are_those_of_the_stretched_cloud() {
    let random = &mut Random(3);
    // 1,200 points take the pass over half of the pairs, 40 the plain one.
    for n in [40, 1200] {
        let (cloud, queries) = (random_cube(n, 3, random), random_cube(9, 3, random));
        let [far_cloud, far_queries] = [&cloud, &queries].map(|points| stretched(points, &FACTORS));
        let values = waves(&cloud);
        for family in families_without_kink() {
            let (ours, theirs) =
                (factorize(&cloud, of_axes(family), 1e-3), factorize(&far_cloud, of_one(family), 1e-3));
            let (u, v) = (fit(&ours, &values), fit(&theirs, &values));
            are_equal(&u.solution.weights, &v.solution.weights, family, "weights");
            for (points, far) in [(&queries, &far_queries), (&**ours.cloud(), &**theirs.cloud())] {
                let [a, b] = [(&u, points), (&v, far)]
                    .map(|(u, points)| u.at(points, JetOrder::Hessian, &Unobserved).unwrap());
                let (gradients, hessians) = by_chain_rule(&b);
                are_equal(&a.values(), &b.values(), family, "values");
                are_equal(&a.gradients(), &gradients, family, "gradients");
                are_equal(&a.hessians(), &hessians, family, "Hessians");
            }
            let ours_covariance = covariance(&ours, &queries, &Unobserved).unwrap();
            let theirs_covariance = covariance(&theirs, &far_queries, &Unobserved).unwrap();
            are_equal(&ours_covariance.latent, &theirs_covariance.latent, family, "covariance");
            let deviations = |of, at| JetDeviations::of(of, 1.0, at, 2, &Unobserved);
            let (Ok(a), Ok(b)) = (deviations(&u, &queries), deviations(&v, &far_queries)) else {
                assert!(!u.solver.kernel().has_second_derivatives(), "{family:?}");
                continue;
            };
            have_equal_deviations(&a, &b, family);
        }
    }
}

/// Asserts that deviations in coordinates follow from those in stretched coordinates.
fn have_equal_deviations(a: &JetDeviations, b: &JetDeviations, family: Family) {
    let first = |at: usize| FACTORS[at % 3];
    let gradients: Vec<f64> = b.gradients.iter().enumerate().map(|(at, g)| g * first(at)).collect();
    let second = |at: usize| FACTORS[at / 3 % 3] * FACTORS[at % 3];
    let hessians: Vec<f64> = b.hessians.iter().enumerate().map(|(at, h)| h * second(at)).collect();
    are_equal(&a.values, &b.values, family, "std");
    are_equal(&a.gradients, &gradients, family, "deviations of gradients");
    are_equal(&a.hessians, &hessians, family, "deviations of Hessians");
}

#[test]
fn kriging_looks_at_the_points_of_the_greatest_covariances() {
    let random = &mut Random(4);
    let (cloud, queries) = (random_cube(2000, 3, random), random_cube(9, 3, random));
    let [far_cloud, far_queries] = [&cloud, &queries].map(|points| stretched(points, &FACTORS));
    let values = waves(&cloud);
    for family in families_without_kink() {
        let has_deviations = of_one(family).has_second_derivatives();
        let request =
            KrigingRequest { order: JetOrder::Hessian, has_variances: true, has_deviations, trend: None };
        let at = |kernel: Kernel, cloud: &Cloud, queries: &Cloud| {
            let sampling = Arc::new(Sampling::of(cloud, &Unobserved).unwrap());
            let system = System::new(Arc::new(cloud.clone()), kernel, Regularization::Uniform(1e-3)).unwrap();
            LocalKriging::new(system, sampling, &Unobserved)
                .unwrap()
                .at(&values, queries, request, &Unobserved)
                .unwrap()
        };
        let a = at(of_axes(family), &cloud, &queries);
        let b = at(of_one(family), &far_cloud, &far_queries);
        let (gradients, hessians) = by_chain_rule(&b.jets);
        are_equal(&a.jets.values(), &b.jets.values(), family, "values");
        are_equal(&a.jets.gradients(), &gradients, family, "gradients");
        are_equal(&a.jets.hessians(), &hessians, family, "Hessians");
        if let [Some(a), Some(b)] = [&a.deviations, &b.deviations] {
            have_equal_deviations(a, b, family);
        }
        let [a, b] = [a, b].map(|answer| answer.variances.unwrap().latent);
        are_equal(&a, &b, family, "variances");
    }
}

#[test]
fn matrices_of_operators_are_the_operators() {
    // The surface has a kernel of its own, so its normals are independent of the stretching.
    let axes = [1.3, 1.0, 0.8];
    let (cloud, queries) =
        (stretched(&fibonacci_sphere(100), &axes), stretched(&fibonacci_sphere(23), &axes));
    let geometry =
        geometry(&factorize(&cloud, kernel(Family::Laplace { epsilon: 1.0 }, 1.0), 1e-6), &queries);
    let values = waves(&cloud);
    for family in families_without_kink() {
        let kernel = Kernel::of_axes(family, &[1.1, 2.3, 0.7], 1.7).unwrap();
        let factor = factorize(&cloud, kernel, 1e-3);
        let u = fit(&factor, &values);
        let product = |matrix: &[f64]| -> Vec<f64> {
            let row = |row: &[f64]| row.iter().zip(&values).map(|(a, y)| a * y).sum();
            matrix.chunks_exact(100).map(row).collect()
        };
        let applied = Operator::LaplaceBeltrami.apply(&geometry, &u, &queries, &Unobserved).unwrap();
        let matrix =
            Operator::LaplaceBeltrami.matrix(&geometry, &factor, &queries, Mean::Zero, &Unobserved).unwrap();
        // A row is right to n ε cond.
        let allowed =
            |matrix: &[f64]| rounding(&factor) * largest(matrix.chunks_exact(100).map(norm)) * norm(&values);
        let apart = distance(&product(&matrix), &applied);
        assert!(apart <= allowed(&matrix), "{family:?}: {apart:e} of {:e}", allowed(&matrix));
        let applied = Operator::SurfaceGradient.apply(&geometry, &u, &queries, &Unobserved).unwrap();
        let matrices =
            Operator::SurfaceGradient.matrix(&geometry, &factor, &queries, Mean::Zero, &Unobserved).unwrap();
        // Matrices come one for each component, gradients one for each query.
        let by_component = product(&matrices);
        let m = queries.n_points();
        let found: Vec<f64> = (0..3 * m).map(|at| by_component[at % 3 * m + at / 3]).collect();
        let apart = distance(&found, &applied);
        assert!(apart <= allowed(&matrices), "{family:?}: {apart:e} of {:e}", allowed(&matrices));
    }
}

#[test]
fn equal_length_scales_are_one() {
    let random = &mut Random(5);
    let (cloud, queries) = (random_cube(60, 2, random), random_cube(9, 2, random));
    for family in families() {
        let [one, both] =
            [Kernel::new(family, 0.7, 2.0).unwrap(), Kernel::of_axes(family, &[0.7, 0.7], 2.0).unwrap()]
                .map(|kernel| variances(&factorize(&cloud, kernel, 1e-6), &queries, &Unobserved).unwrap());
        assert_eq!(one.latent, both.latent, "{family:?}");
    }
}

#[test]
fn axes_that_the_points_do_not_have_are_refused() {
    let cloud = Arc::new(fibonacci_sphere(10));
    let kernel = Kernel::of_axes(Family::Gauss, &[1.0, 2.0], 1.0).unwrap();
    assert!(System::new(cloud, kernel, Regularization::Uniform(0.0)).is_err());
    assert!(Kernel::of_axes(Family::Gauss, &[], 1.0).is_err());
    assert!(Kernel::of_axes(Family::Gauss, &[1.0, 0.0], 1.0).is_err());
}
