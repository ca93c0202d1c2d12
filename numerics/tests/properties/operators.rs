//! Operators and shape: constants, coordinates of spheres, and the shape operator
//! against differences of normals.

use std::sync::Arc;

use gramian_numerics::kernel::{Family, WendlandSmoothness};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::operators::Operator;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::regression::solver::Solver;
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::regression::sums::jets::JetOrder;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest, Orientation, SurfaceModel};

use crate::common::clouds::{circle, fibonacci_sphere, stretched, turned_circle};
use crate::common::fits::{factorize, fit, geometry, surface};
use crate::support::{
    EPS, distance, dot, families, families_without_kink, kernel, largest, norm, rounding, shifted, width,
};

const C4: Family = Family::Wendland { smoothness: WendlandSmoothness::C4 };
const C6: Family = Family::Wendland { smoothness: WendlandSmoothness::C6 };

/// Smoothness p of a kernel in C^{2p}, whose native space is H^{p + (d+1)/2}. 4 stands for 4 and more, where
/// rounding ends the asymptotics.
///
/// Laplace ε = 0.01 counts as rough: with √ε ℓ below the spacing the analytic neighbourhood of
/// its cusp is not resolved.
fn smoothness(family: Family) -> i32 {
    match family {
        Family::Matern { order } => i32::from(order.min(4)),
        Family::Wendland { smoothness: WendlandSmoothness::C2 } => 1,
        Family::Wendland { smoothness: WendlandSmoothness::C4 } => 2,
        Family::Wendland { smoothness: WendlandSmoothness::C6 } => 3,
        Family::Laplace { epsilon } if epsilon < 0.1 => 1,
        Family::Laplace { .. } | Family::Gauss | Family::InverseMultiquadric => 4,
    }
}

fn exact_factor(cloud: &Cloud, family: Family, length_scale: f64) -> Arc<Solver> {
    factorize(cloud, kernel(family, width(family) * length_scale), 0.0)
}

fn laplacian(geometry: &Geometry, u: &Interpolant, queries: &Cloud) -> Vec<f64> {
    Operator::LaplaceBeltrami.apply(geometry, u, queries, &Unobserved).unwrap()
}

/// An ellipsoid, and queries on it that are none of its points, where all kernels are smooth.
fn ellipsoid() -> (Cloud, Cloud) {
    let axes = [1.3, 1.0, 0.8];
    (stretched(&fibonacci_sphere(100), &axes), stretched(&fibonacci_sphere(23), &axes))
}

#[test]
fn one_fit_for_surface_and_values_annihilates_constants() {
    let (cloud, queries) = ellipsoid();
    for family in families() {
        let factor = factorize(&cloud, kernel(family, 1.0), 1e-6);
        let (u, geometry) = (fit(&factor, &vec![1.0; 100]), geometry(&factor, &queries));
        let gradients = Operator::SurfaceGradient.apply(&geometry, &u, &queries, &Unobserved).unwrap();
        let laplacians = laplacian(&geometry, &u, &queries);
        let matrix =
            Operator::LaplaceBeltrami.matrix(&geometry, &factor, &queries, Mean::Zero, &Unobserved).unwrap();
        let jets = u.at(&queries, JetOrder::Hessian, &Unobserved).unwrap();
        for query in 0..queries.n_points() {
            // The two terms cancel up to the rounding of the few operations that compute each of them.
            let (slope, bend) = (norm(jets.gradient(query)), norm(&jets.hessian(query)));
            assert!(norm(&gradients[query * 3..][..3]) <= 16.0 * EPS * slope, "{family:?}: gradient");
            assert!(laplacians[query].abs() <= 64.0 * EPS * bend, "{family:?}: {:e}", laplacians[query]);
            // A row of the matrix is right to n ε cond.
            let row = &matrix[query * 100..][..100];
            let tolerance = rounding(&factor) * norm(row);
            assert!(row.iter().sum::<f64>().abs() <= tolerance, "{family:?}: matrix times ones");
        }
    }
}

#[test]
fn with_two_kernels_the_laplacian_of_a_constant_tends_to_zero() {
    let laplace = Family::Laplace { epsilon: 1.0 };
    let matern = |order| Family::Matern { order };
    let pairs = [
        (laplace, matern(3)),
        (Family::Gauss, matern(4)),
        (matern(4), C6),
        (Family::InverseMultiquadric, laplace),
        (C6, matern(2)),
        (matern(5), Family::InverseMultiquadric),
        (matern(2), Family::Gauss),
        (matern(3), C4),
    ];
    for (surface, data) in pairs {
        let errors = [64, 128, 256, 512].map(|n| {
            let cloud = fibonacci_sphere(n);
            let constant = fit(&exact_factor(&cloud, data, 1.0), &vec![1.0; n]);
            let geometry = geometry(&exact_factor(&cloud, surface, 1.0), &cloud);
            largest(laplacian(&geometry, &constant, &cloud))
        });
        // The order is h^{2p+1} as for coordinates, with h ~ n^{−1/2}. Half of the gain is asserted.
        let gain = 0.5 * 2f64.powf(f64::from(smoothness(surface).min(smoothness(data))) + 0.5);
        let converges = errors.windows(2).all(|pair| pair[1] * gain < pair[0]);
        assert!(converges, "{surface:?} with {data:?}: {errors:?}, expected to gain {gain}");
    }
}

/// Largest error of Δ x_c = −(d − 1) x_c over the coordinates of the unit sphere.
/// Surface and values share a fit.
fn coordinate_error(factor: &Arc<Solver>, queries: &Cloud) -> f64 {
    let (cloud, geometry) = (factor.cloud(), geometry(factor, queries));
    assert!(geometry.is_null().iter().all(|is_null| !is_null));
    let error = |axis: usize| {
        let values: Vec<f64> = cloud.points().map(|x| x[axis]).collect();
        let found = laplacian(&geometry, &fit(factor, &values), queries);
        let eigenvalue = cloud.dimension() as f64 - 1.0;
        largest(found.iter().zip(queries.points()).map(|(found, x)| found + eigenvalue * x[axis]))
    };
    largest((0..cloud.dimension()).map(error))
}

/// Checks the order at which the Laplacians of the coordinates converge, on the points and between them.
///
/// Kernels with a kink are left out. They have no Laplacian at the points, and away from them
/// theirs does not converge.
///
/// In the native space H^m of R^d, m = p + (d + 1)/2, smooth data converge at twice the theorem's
/// order (errata.md, 11). For the function this is 2(m − ½) = 2p + d in h. Every derivative costs
/// one, so Δ has 2p + d − 2.
///
/// Constants stay under 30 at the scale h/ℓ. Half of the gain is asserted. Below 1e-10 the error is the
/// rounding of second derivatives.
fn check_coordinates(clouds: [Cloud; 2], spacings: [f64; 2], queries: &Cloud, length_scale: f64) {
    for family in families_without_kink() {
        let order = 2 * smoothness(family) + queries.dimension() as i32 - 2;
        let factors = clouds.each_ref().map(|cloud| exact_factor(cloud, family, length_scale));
        let on_the_points = factors.each_ref().map(|factor| coordinate_error(factor, factor.cloud()));
        let between = factors.each_ref().map(|factor| coordinate_error(factor, queries));
        let gain = 0.5 * (spacings[0] / spacings[1]).powi(order);
        for errors in [on_the_points, between] {
            let bounds = spacings.map(|h| 30.0 * (h / length_scale).powi(order));
            assert!(errors[0] <= bounds[0] && errors[1] <= bounds[1], "{family:?}: {errors:?}, {bounds:?}");
            assert!(errors[1] * gain <= errors[0] || errors[1] < 1e-10, "{family:?}: {errors:?}, {gain}");
        }
    }
}

#[test]
fn the_laplacian_of_the_coordinates_of_the_sphere_is_minus_twice_them() {
    let spacing = |n: f64| (4.0 * std::f64::consts::PI / n).sqrt();
    let clouds = [fibonacci_sphere(128), fibonacci_sphere(512)];
    check_coordinates(clouds, [spacing(128.0), spacing(512.0)], &fibonacci_sphere(37), 2.0);
}

#[test]
fn the_laplacian_of_the_coordinates_of_the_circle_is_minus_them() {
    let spacing = |n: f64| 2.0 * std::f64::consts::PI / n;
    let clouds = [circle(40), circle(80)];
    check_coordinates(clouds, [spacing(40.0), spacing(80.0)], &turned_circle(17, 0.37), 1.0);
}

#[test]
fn the_shape_operator_is_the_derivative_of_the_normals() {
    let ((cloud, queries), h) = (ellipsoid(), 1e-5);
    for family in families() {
        let factor = factorize(&cloud, kernel(family, 1.5), 1e-4);
        let here = geometry(&factor, &queries);
        let curvatures = here.curvatures(&Unobserved).unwrap();
        let slopes: Vec<Vec<f64>> = (0..3)
            .map(|axis| {
                let above = geometry(&factor, &shifted(&queries, axis, h));
                let below = geometry(&factor, &shifted(&queries, axis, -h));
                let pairs = above.normals().iter().zip(below.normals());
                pairs.map(|(a, b)| (a - b) / (2.0 * h)).collect()
            })
            .collect();
        for query in (0..queries.n_points()).filter(|&query| !here.is_null()[query]) {
            // Dν v = Σ_axis v_axis ∂_axis ν.
            let along = |v: &[f64], c: usize| (0..3).map(|axis| v[axis] * slopes[axis][query * 3 + c]).sum();
            let divergence: f64 = (0..3).map(|axis| slopes[axis][query * 3 + axis]).sum();
            let size = slopes.iter().map(|slope| norm(&slope[query * 3..][..3])).fold(1.0, f64::max);
            // Truncation is h² over the square of the distance to the nearest kink, 0.05
            // or more. Rounding is ε/h.
            let tolerance = 1e-7 * size;
            let error = (divergence - here.trace_of_shape_operator(query)).abs();
            assert!(error <= tolerance, "{family:?}: trace off by {error:e} of {divergence}");
            for k in 0..2 {
                let direction = &curvatures.directions[query * 6 + k * 3..][..3];
                let found: Vec<f64> = (0..3).map(|c| along(direction, c)).collect();
                let expected: Vec<f64> =
                    direction.iter().map(|x| curvatures.principal[query * 2 + k] * x).collect();
                assert!(distance(&found, &expected) <= tolerance, "{family:?}: {found:?} not {expected:?}");
                assert!(dot(direction, here.normal(query)).abs() <= 4.0 * EPS, "{family:?}: not tangent");
            }
        }
    }
}

#[test]
fn turning_the_normals_around_negates_curvatures_and_keeps_the_laplacian() {
    let (cloud, queries) = ellipsoid();
    let values: Vec<f64> = cloud.points().map(|x| x[0] * x[1]).collect();
    for family in families() {
        let factor = factorize(&cloud, kernel(family, 1.0), 1e-6);
        let surface = surface(&factor);
        let [outward, inward] = [Orientation::Outward, Orientation::Gradient].map(|orientation| {
            let model = SurfaceModel::Signature;
            let request = GeometryRequest { orientation, model, ..GeometryRequest::CURVATURES };
            Geometry::of(&surface, &queries, &request, &Unobserved).unwrap()
        });
        let negated: Vec<f64> = inward.normals().iter().map(|x| -x).collect();
        assert!(outward.normals() == negated, "{family:?}: normals");
        let negated: Vec<f64> = inward.curvatures(&Unobserved).unwrap().mean.iter().map(|x| -x).collect();
        let mean = outward.curvatures(&Unobserved).unwrap().mean;
        let scale = 8.0 * EPS * largest(outward.curvatures(&Unobserved).unwrap().principal);
        assert!(distance(&mean, &negated) <= scale, "{family:?}: mean curvatures");
        let u = fit(&factor, &values);
        assert!(
            laplacian(&outward, &u, &queries) == laplacian(&inward, &u, &queries),
            "{family:?}: Laplacian"
        );
    }
}
