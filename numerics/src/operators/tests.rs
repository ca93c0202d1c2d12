use super::*;
use crate::kernel::{Family, Kernel};
use crate::observer::Unobserved;
use crate::regression::solver::System;
use crate::regression::solver::trend::Mean;
use crate::regression::sums::regularization::Regularization;
use crate::surface::Surface;
use crate::surface::geometry::{GeometryRequest, SurfaceModel};
use crate::testing::{all_families, circle, fibonacci_sphere};

fn solver(cloud: &Cloud, family: Family, length_scale: f64, alpha: f64) -> Arc<Solver> {
    let kernel = Kernel::new(family, length_scale, 1.0).unwrap();
    let alpha = Regularization::uniform(alpha).unwrap();
    Arc::new(
        System::new(Arc::new(cloud.clone()), kernel, alpha)
            .and_then(|system| Solver::dense(system, &Unobserved))
            .unwrap(),
    )
}

fn geometry(solver: &Arc<Solver>, queries: &Cloud) -> Geometry {
    let signature = Interpolant::signature(solver.clone(), &Unobserved).unwrap();
    let surface = Surface::of(signature, None, &Unobserved).unwrap();
    let request = GeometryRequest { model: SurfaceModel::Signature, ..GeometryRequest::CURVATURES };
    Geometry::of(&surface, queries, &request, &Unobserved).unwrap()
}

fn largest(errors: impl Iterator<Item = f64>) -> f64 {
    errors.fold(0.0, |a, b| a.max(b.abs()))
}

#[test]
fn the_laplacian_of_cosine_on_the_circle_is_minus_cosine() {
    let cloud = circle(40);
    let solver = solver(&cloud, Family::Laplace { epsilon: 1.0 }, 1.0, 0.0);
    let cosine: Vec<f64> = cloud.points().map(|x| x[0]).collect();
    let interpolant = Interpolant::fit(solver.clone(), &cosine, &Unobserved).unwrap();
    let found = Operator::LaplaceBeltrami
        .apply(&geometry(&solver, &cloud), &interpolant, &cloud, &Unobserved)
        .unwrap();
    assert!(largest(found.iter().zip(&cosine).map(|(f, c)| f + c)) < 1e-6);
}

#[test]
fn the_laplacian_of_the_coordinates_of_a_sphere_is_minus_twice_them() {
    // Laplace ε = 1 on 256 points reaches 4e-5 for a function with ten times the derivatives (errata.md).
    let cloud = fibonacci_sphere(256);
    let solver = solver(&cloud, Family::Laplace { epsilon: 1.0 }, 1.0, 0.0);
    let geometry = geometry(&solver, &cloud);
    for axis in 0..3 {
        let values: Vec<f64> = cloud.points().map(|x| x[axis]).collect();
        let interpolant = Interpolant::fit(solver.clone(), &values, &Unobserved).unwrap();
        let found = Operator::LaplaceBeltrami.apply(&geometry, &interpolant, &cloud, &Unobserved).unwrap();
        assert!(largest(found.iter().zip(&values).map(|(f, v)| f + 2.0 * v)) < 1e-4);
    }
}

#[test]
fn matrices_times_values_are_the_operators_applied() {
    let cloud = fibonacci_sphere(90);
    let queries = fibonacci_sphere(31);
    let values: Vec<f64> = cloud.points().map(|x| x[0] * x[1] + x[2]).collect();
    for family in all_families().into_iter().filter(|&f| !Kernel::new(f, 1.0, 1.0).unwrap().has_kink()) {
        let solver = solver(&cloud, family, 1.0, 1e-8);
        let geometry = geometry(&solver, &queries);
        let interpolant = Interpolant::fit(solver.clone(), &values, &Unobserved).unwrap();

        let applied =
            Operator::LaplaceBeltrami.apply(&geometry, &interpolant, &queries, &Unobserved).unwrap();
        let matrix =
            Operator::LaplaceBeltrami.matrix(&geometry, &solver, &queries, Mean::Zero, &Unobserved).unwrap();
        let product: Vec<f64> = matrix.chunks(90).map(|row| dot(row, &values)).collect();
        // Weights reach Y/α^{1/2}, so that cancellation in the row sums costs up to six digits here.
        let scale = largest(applied.iter().copied()).max(1.0);
        let error = largest(applied.iter().zip(&product).map(|(a, b)| a - b));
        assert!(error < 1e-7 * scale, "{family:?}: {error:e}");

        let applied =
            Operator::SurfaceGradient.apply(&geometry, &interpolant, &queries, &Unobserved).unwrap();
        let matrices =
            Operator::SurfaceGradient.matrix(&geometry, &solver, &queries, Mean::Zero, &Unobserved).unwrap();
        for (row, component) in matrices.chunks(90).enumerate() {
            let (axis, query) = (row / 31, row % 31);
            let error = (dot(component, &values) - applied[query * 3 + axis]).abs();
            assert!(error < 1e-7, "{family:?}: {error:e}");
        }
    }
}

#[test]
fn one_fit_for_both_annihilates_constants() {
    let cloud = fibonacci_sphere(120);
    let solver = solver(&cloud, Family::Matern { order: 3 }, 1.0, 1e-10);
    let geometry = geometry(&solver, &cloud);
    let constant = Interpolant::signature(solver.clone(), &Unobserved).unwrap();
    let gradients = Operator::SurfaceGradient.apply(&geometry, &constant, &cloud, &Unobserved).unwrap();
    let laplacians = Operator::LaplaceBeltrami.apply(&geometry, &constant, &cloud, &Unobserved).unwrap();
    assert!(largest(gradients.into_iter()) < 1e-12);
    assert!(largest(laplacians.into_iter()) < 1e-10);
}

#[test]
fn with_different_kernels_the_laplacian_of_a_constant_tends_to_zero() {
    let error = |n: usize| {
        let cloud = fibonacci_sphere(n);
        let surface = solver(&cloud, Family::Laplace { epsilon: 1.0 }, 1.0, 0.0);
        let data = solver(&cloud, Family::Matern { order: 3 }, 1.0, 0.0);
        let constant = Interpolant::signature(data, &Unobserved).unwrap();
        let found = Operator::LaplaceBeltrami
            .apply(&geometry(&surface, &cloud), &constant, &cloud, &Unobserved)
            .unwrap();
        largest(found.into_iter())
    };
    let errors = [error(64), error(128), error(256), error(512)];
    assert!(errors.windows(2).all(|w| w[1] < 0.5 * w[0]), "{errors:?}");
    assert!(errors[3] < 1e-3, "{errors:?}");
}

#[test]
fn the_surface_gradient_is_tangent() {
    let cloud = fibonacci_sphere(150);
    let solver = solver(&cloud, Family::InverseMultiquadric, 1.0, 1e-9);
    let geometry = geometry(&solver, &cloud);
    let values: Vec<f64> = cloud.points().map(|x| x[2]).collect();
    let interpolant = Interpolant::fit(solver, &values, &Unobserved).unwrap();
    let gradients = Operator::SurfaceGradient.apply(&geometry, &interpolant, &cloud, &Unobserved).unwrap();
    for (query, gradient) in gradients.chunks(3).enumerate() {
        let x = cloud.point(query);
        assert!(dot(gradient, geometry.normal(query)).abs() < 1e-12);
        // ∇_S z = e₃ − z x.
        let expected = [-x[2] * x[0], -x[2] * x[1], 1.0 - x[2] * x[2]];
        assert!(largest(gradient.iter().zip(&expected).map(|(a, b)| a - b)) < 1e-3);
    }
}

#[test]
fn matrices_with_a_mean_are_the_operators_on_functions_with_one() {
    let cloud = Arc::new(fibonacci_sphere(120));
    let kernel = Kernel::new(Family::Matern { order: 3 }, 1.0, 1.0).unwrap();
    let system = System::new(cloud.clone(), kernel, Regularization::uniform(1e-6).unwrap()).unwrap();
    let solver = Arc::new(Solver::dense(system, &Unobserved).unwrap());
    let surface =
        Surface::of(Interpolant::signature(solver.clone(), &Unobserved).unwrap(), None, &Unobserved).unwrap();
    let queries = cloud.select(&[0, 17, 60, 119]);
    let geometry = Geometry::of(&surface, &queries, &GeometryRequest::CURVATURES, &Unobserved).unwrap();
    let values: Vec<f64> = cloud.points().map(|x| 5.0 + x[0] - 2.0 * x[1] * x[2]).collect();
    let times = |matrix: &[f64], values: &[f64]| -> Vec<f64> {
        matrix.chunks_exact(values.len()).map(|row| dot(row, values)).collect()
    };
    for mean in [Mean::Constant, Mean::Linear] {
        let u = Interpolant::fit_with_mean(solver.clone(), &values, mean, &Unobserved).unwrap();
        let matrix =
            Operator::LaplaceBeltrami.matrix(&geometry, &solver, &queries, mean, &Unobserved).unwrap();
        let applied = Operator::LaplaceBeltrami.apply(&geometry, &u, &queries, &Unobserved).unwrap();
        // Entries of hundreds add up to numbers of order one.
        let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(near(&times(&matrix, &values), &applied), "{mean:?}");
        assert!(near(&times(&matrix, &[1.0; 120]), &[0.0; 4]), "constants are 0");
        let matrices =
            Operator::SurfaceGradient.matrix(&geometry, &solver, &queries, mean, &Unobserved).unwrap();
        let applied = Operator::SurfaceGradient.apply(&geometry, &u, &queries, &Unobserved).unwrap();
        let found = times(&matrices, &values);
        let transposed: Vec<f64> = (0..12).map(|at| found[at % 3 * 4 + at / 3]).collect();
        assert!(near(&transposed, &applied), "{mean:?}");
    }
}
