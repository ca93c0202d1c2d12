//! Units of length, and two sizes in one cloud.

use std::sync::Arc;

use gramian_numerics::kernel::defaults::Purpose;
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest};
use gramian_numerics::surface::local::{LocalInputs, LocalSurface};

use super::common::clouds::{fibonacci_sphere, noisy, random_torus};
use super::common::fits::{default_kernel_and_alpha, factorize};
use super::common::random::Random;

fn dense(cloud: &Arc<Cloud>) -> Surface {
    let (kernel, alpha) = default_kernel_and_alpha(cloud, Purpose::Curvatures);
    let signature = Interpolant::signature(factorize(cloud, kernel, alpha), &Unobserved).unwrap();
    Surface::of(signature, None, &Unobserved).unwrap()
}

fn local(cloud: &Arc<Cloud>) -> Surface {
    let sampling = Arc::new(Sampling::of(cloud, &Unobserved).unwrap());
    LocalSurface::of(cloud.clone(), sampling, LocalInputs::default(), &Unobserved).unwrap().into()
}

fn geometry(surface: &Surface, cloud: &Cloud, has_deviations: bool) -> Geometry {
    let request = GeometryRequest { has_deviations, ..GeometryRequest::CURVATURES };
    Geometry::of(surface, cloud, &request, &Unobserved).unwrap()
}

/// Curvatures, normals and deviations in units of `size`, and the queries with a flag.
fn answers(geometry: &Geometry, size: f64) -> (Vec<f64>, Vec<usize>) {
    let curvatures = geometry.curvatures(&Unobserved).unwrap();
    let lengths = curvatures.principal.iter().map(|kappa| kappa * size);
    let mut numbers: Vec<f64> = lengths.chain(geometry.normals().iter().copied()).collect();
    if let Some(found) = geometry.deviations() {
        numbers.extend(found.principal.iter().chain(&found.mean).map(|deviation| deviation * size));
        numbers.extend(found.gaussian.iter().map(|deviation| deviation * size * size));
        numbers.extend(&found.normal);
    }
    (numbers, geometry.flags().iter().map(|entry| entry.query).collect())
}

#[test]
fn the_unit_of_length_changes_neither_answers_nor_flags() {
    let cloud = noisy(&random_torus(400, &mut Random(31)), 0.003, &mut Random(32));
    let at = |size: f64, surface: fn(&Arc<Cloud>) -> Surface, has_deviations: bool| {
        let scaled = cloud.coordinates().iter().map(|x| x * size).collect();
        let scaled = Arc::new(Cloud::new(scaled, 3).unwrap());
        answers(&geometry(&surface(&scaled), &scaled, has_deviations), size)
    };
    // Squares of second derivatives overflow float64 at sizes below 1e-77, and fourth powers below 1e-38.
    // The sizes are powers of 2, which change no other rounding.
    for (surface, has_deviations) in [(dense as fn(&Arc<Cloud>) -> Surface, false), (local, true)] {
        let (expected, flags) = at(1.0, surface, has_deviations);
        for size in [-360, -260, -130, 200].map(|power| 2f64.powi(power)) {
            let (found, found_flags) = at(size, surface, has_deviations);
            assert_eq!(flags, found_flags, "{size}");
            for (expected, found) in expected.iter().zip(found) {
                // Rounding times the condition of a fit.
                assert!(
                    (expected - found).abs() < 1e-7 * (1.0 + expected.abs()),
                    "{size}: {expected} {found}"
                );
            }
        }
    }
}

/// Two spheres of 400 points each: the unit sphere, and one of another radius beside it.
fn two_spheres(radius: f64) -> Arc<Cloud> {
    let sphere = fibonacci_sphere(400);
    let other = sphere.points().flat_map(|x| [1.5 + radius * x[0], radius * x[1], radius * x[2]]);
    Arc::new(Cloud::new(sphere.coordinates().iter().copied().chain(other).collect(), 3).unwrap())
}

#[test]
fn two_sizes_in_one_cloud_are_right_from_the_nearest_points_and_flagged_from_all() {
    for radius in [1e-2, 1e-4, 1e-8] {
        let cloud = two_spheres(radius);
        for (is_local, surface) in [(true, local(&cloud)), (false, dense(&cloud))] {
            let geometry = geometry(&surface, &cloud, false);
            let curvatures = geometry.curvatures(&Unobserved).unwrap();
            let n_flagged = geometry.flags().len();
            assert!(!is_local || n_flagged == 0, "{radius}: {n_flagged}");
            let is_flagged = |i: usize| geometry.flags().iter().any(|entry| entry.query == i);
            for i in (0..800).filter(|&i| !is_flagged(i)) {
                let (centre, size) = if i < 400 { (0.0, 1.0) } else { (1.5, radius) };
                let x = cloud.point(i);
                let normal = geometry.normal(i);
                let along = (normal[0] * (x[0] - centre) + normal[1] * x[1] + normal[2] * x[2]) / size;
                // 30° for normals, and half of a curvature.
                assert!(along > 0.866, "{radius} {i}: {along}");
                for kappa in &curvatures.principal[2 * i..2 * i + 2] {
                    assert!(
                        (kappa * size - 1.0).abs() < if is_local { 1e-3 } else { 0.5 },
                        "{radius} {i}: {kappa}"
                    );
                }
            }
        }
    }
}
