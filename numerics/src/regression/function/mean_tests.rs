//! Tests of functions with a mean against universal kriging, and of functionals against differences.

use std::sync::Arc;

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::deviations::JetDeviations;
use super::interpolant::Interpolant;
use super::posterior::{covariance, covariance_with_mean, variances_with_mean};
use crate::error::NumericsError;
use crate::kernel::{Family, Kernel, WendlandSmoothness};
use crate::observer::Unobserved;
use crate::points::cloud::Cloud;
use crate::regression::solver::trend::Mean;
use crate::regression::solver::{Solver, System};
use crate::regression::sums::jets::JetOrder;
use crate::regression::sums::regularization::Regularization;
use crate::testing::fibonacci_sphere;

fn interpolant(family: Family, values: &[f64], mean: Mean) -> Interpolant {
    let cloud = Arc::new(fibonacci_sphere(values.len()));
    let kernel = Kernel::new(family, 1.1, 2.0).unwrap();
    let system = System::new(cloud, kernel, Regularization::uniform(1e-3).unwrap()).unwrap();
    let solver = Arc::new(Solver::dense(system, &Unobserved).unwrap());
    Interpolant::fit_with_mean(solver, values, mean, &Unobserved).unwrap()
}

fn values(n: usize) -> Vec<f64> {
    fibonacci_sphere(n).points().map(|x| 3.0 + (2.0 * x[0]).sin() - x[1] * x[2]).collect()
}

fn matern(x: &[f64], y: &[f64]) -> f64 {
    let r = x.iter().zip(y).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt() / 1.1;
    let s = 5f64.sqrt() * r;
    2.0 * (1.0 + s + s * s / 3.0) * (-s).exp()
}

/// Returns mean and variance at a query from the saddle point system of universal kriging.
///
/// Source: Chilès and Delfiner 2012, eq. 3.20.
fn kriged(values: &[f64], mean: Mean, query: &[f64]) -> [f64; 2] {
    let (n, p) = (values.len(), mean.n_functions(3));
    let cloud = fibonacci_sphere(n);
    let function = |a: usize, x: &[f64]| if a == 0 { 1.0 } else { x[a - 1] };
    let entry = |i: usize, j: usize| match (i < n, j < n) {
        (true, true) => matern(cloud.point(i), cloud.point(j)) + if i == j { 1e-3 } else { 0.0 },
        (true, false) => function(j - n, cloud.point(i)),
        (false, true) => function(i - n, cloud.point(j)),
        (false, false) => 0.0,
    };
    let matrix = Mat::from_fn(n + p, n + p, entry);
    let right =
        Mat::from_fn(
            n + p,
            1,
            |i, _| {
                if i < n { matern(cloud.point(i), query) } else { function(i - n, query) }
            },
        );
    let weights = matrix.full_piv_lu().solve(&right);
    let mean = (0..n).map(|i| weights[(i, 0)] * values[i]).sum();
    [mean, 2.0 - (0..n + p).map(|i| weights[(i, 0)] * right[(i, 0)]).sum::<f64>()]
}

#[test]
fn a_function_with_a_mean_is_universal_kriging() {
    let values = values(40);
    let queries = Cloud::new(vec![0.3, -0.5, 0.9, 2.0, 1.0, -3.0, 0.0, 0.0, 0.0], 3).unwrap();
    for mean in [Mean::Zero, Mean::Constant, Mean::Linear] {
        let u = interpolant(Family::Matern { order: 2 }, &values, mean);
        let found = u.at(&queries, JetOrder::Value, &Unobserved).unwrap().values();
        let trend = u.solution.trend.as_ref();
        let variances = variances_with_mean(&u.solver, trend, &queries, &Unobserved).unwrap().latent;
        let covariance = covariance_with_mean(&u.solver, trend, &queries, &Unobserved).unwrap().latent;
        let bars = JetDeviations::of(&u, 4.0, &queries, 0, &Unobserved).unwrap().values;
        for query in 0..3 {
            let [value, variance] = kriged(&values, mean, queries.point(query));
            assert!((found[query] - value).abs() < 1e-11, "{mean:?}: {} {value}", found[query]);
            assert!((variances[query] - variance).abs() < 1e-10, "{mean:?}: {} {variance}", variances[query]);
            assert!((covariance[query * 4] - variance).abs() < 1e-10);
            assert!((bars[query] - 2.0 * variance.sqrt()).abs() < 1e-9, "four times the variance");
        }
    }
}

#[test]
fn the_mean_is_found_whatever_the_offset_and_reported_in_coordinates() {
    let plane: Vec<f64> = fibonacci_sphere(60).points().map(|x| 1e6 + 2.0 * x[0] - 0.5 * x[2]).collect();
    let u = interpolant(Family::Gauss, &plane, Mean::Linear);
    let found = u.solution.trend.as_ref().unwrap().of_coordinates();
    let expected = [1e6, 2.0, 0.0, -0.5];
    // Rounding of values of size 1e6.
    assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-8), "{found:?}");
    let far = Cloud::new(vec![10.0, 20.0, -30.0], 3).unwrap();
    let jets = u.at(&far, JetOrder::Hessian, &Unobserved).unwrap();
    assert!((jets.values()[0] - (1e6 + 20.0 + 15.0)).abs() < 1e-6);
    assert!((jets.gradient(0)[0] - 2.0).abs() < 1e-8);
}

#[test]
fn a_mean_that_the_points_do_not_determine_is_refused() {
    let flat = Cloud::new((0..30).flat_map(|i| [f64::from(i), f64::from(i * i), 0.0]).collect(), 3).unwrap();
    let kernel = Kernel::new(Family::Gauss, 5.0, 1.0).unwrap();
    let system = System::new(Arc::new(flat), kernel, Regularization::uniform(0.1).unwrap()).unwrap();
    let solver = Arc::new(Solver::dense(system, &Unobserved).unwrap());
    let refused = Interpolant::fit_with_mean(solver, &[1.0; 30], Mean::Linear, &Unobserved).err();
    assert_eq!(refused, Some(NumericsError::MeanNotDetermined));
}

#[test]
fn deviations_of_derivatives_are_those_of_differences() {
    let values = values(60);
    let families = [
        Family::Matern { order: 2 },
        Family::Matern { order: 4 },
        Family::Gauss,
        Family::InverseMultiquadric,
        Family::Laplace { epsilon: 1.0 },
        Family::Wendland { smoothness: WendlandSmoothness::C6 },
    ];
    // A stencil about one query: the centre, then a step forward and back along each axis.
    let (x, h) = ([0.4, -0.3, 0.6], 1e-3);
    let mut stencil = x.to_vec();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            stencil.extend((0..3).map(|c| x[c] + if c == axis { sign * h } else { 0.0 }));
        }
    }
    let stencil = Cloud::new(stencil, 3).unwrap();
    for family in families {
        let u = interpolant(family, &values, Mean::Zero);
        let query = Cloud::new(x.to_vec(), 3).unwrap();
        let bars = JetDeviations::of(&u, 1.0, &query, 2, &Unobserved).unwrap();
        let covariance = covariance(&u.solver, &stencil, &Unobserved).unwrap().latent;
        let form = |weights: &[f64; 7]| -> f64 {
            let pairs = (0..49).map(|at| weights[at / 7] * weights[at % 7] * covariance[at]);
            pairs.sum::<f64>().sqrt()
        };
        for axis in 0..3 {
            let (mut slope, mut bend) = ([0.0; 7], [0.0; 7]);
            (slope[1 + 2 * axis], slope[2 + 2 * axis]) = (0.5 / h, -0.5 / h);
            (bend[0], bend[1 + 2 * axis], bend[2 + 2 * axis]) = (-2.0 / h / h, 1.0 / h / h, 1.0 / h / h);
            let (slope, bend) = (form(&slope), form(&bend));
            // The error is of order h² where derivatives exist three times, and of order h where φ has only
            // four.
            assert!((bars.gradients[axis] / slope - 1.0).abs() < 1e-4, "{family:?}");
            assert!(
                (bars.hessians[4 * axis] / bend - 1.0).abs() < 5e-3,
                "{family:?}: {} {bend}",
                bars.hessians[4 * axis]
            );
        }
        let symmetric = (0..9).all(|at| bars.hessians[at] == bars.hessians[at % 3 * 3 + at / 3]);
        assert!(symmetric);
    }
}

#[test]
fn derivatives_that_the_process_lacks_have_no_deviations() {
    let query = Cloud::new(vec![0.4, 0.2, 0.1], 3).unwrap();
    for family in [Family::Matern { order: 1 }, Family::Wendland { smoothness: WendlandSmoothness::C2 }] {
        let u = interpolant(family, &values(30), Mean::Zero);
        assert!(JetDeviations::of(&u, 1.0, &query, 1, &Unobserved).is_ok());
        let refused = JetDeviations::of(&u, 1.0, &query, 2, &Unobserved).unwrap_err();
        assert_eq!(refused, NumericsError::DerivativesVary { order: 2 });
    }
    let u = interpolant(Family::Matern { order: 0 }, &values(30), Mean::Zero);
    let refused = JetDeviations::of(&u, 1.0, &query, 1, &Unobserved).unwrap_err();
    assert_eq!(refused, NumericsError::DerivativesVary { order: 1 });
}
