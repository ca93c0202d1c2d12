//! Open surfaces and those without mean curvature. The signature function has no gradient
//! there, the offset model has.

use gramian_numerics::kernel::{Family, WendlandSmoothness};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::surface::flags::FlagReason;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest, Orientation, SurfaceModel};

use super::clouds::{OrientedCloud, cylinder, flat_square, graph, half_sphere};
use super::common::random::Random;
use super::support::{cosines, geometry, n_wrong, surface, surface_of};

const CURVATURES: GeometryRequest = GeometryRequest::CURVATURES;

const FAMILIES: [(Family, f64); 6] = [
    (Family::Gauss, 1.0),
    (Family::Laplace { epsilon: 1.0 }, 1.0),
    (Family::Matern { order: 1 }, 1.0),
    (Family::Matern { order: 2 }, 1.0),
    (Family::Wendland { smoothness: WendlandSmoothness::C4 }, 3.0),
    (Family::InverseMultiquadric, 1.0),
];

/// Smallest magnitude of the cosines. The sign does not count, since an open surface has no outside.
fn smallest_cosine(found: &[Option<f64>]) -> f64 {
    found.iter().map(|cosine| cosine.map_or(0.0, f64::abs)).fold(1.0, f64::min)
}

#[test]
fn a_flat_square_has_no_curvature_and_one_normal() {
    let clouds = [flat_square(15, None), flat_square(15, Some(&mut Random(7)))];
    for cloud in &clouds {
        for (family, length_scale) in FAMILIES {
            let surface = surface_of(cloud, family, length_scale);
            assert!(surface.orientation().is_open, "{family:?}");
            let geometry = geometry(&surface, &CURVATURES);
            let found = cosines(&geometry, &cloud.normals);
            // The plane passes through the points to rounding, and no term of the model bends it to one side.
            assert!(smallest_cosine(&found) > 1.0 - 1e-9, "{family:?}: {}", smallest_cosine(&found));
            let wrong = n_wrong(&found);
            assert!(wrong == 0 || wrong == found.len(), "{family:?}: normals on both sides");
            let principal = geometry.curvatures(&Unobserved).unwrap().principal;
            let largest = principal.iter().fold(0.0, |a: f64, k| a.max(k.abs()));
            assert!(largest < 1e-8, "{family:?}: {largest:e}");
            assert!(geometry.flags().is_empty(), "{family:?}: {:?}", geometry.flags());
        }
    }
}

/// Normals of the signature function alone would lie in the plane of a square. They must be null instead.
#[test]
fn the_signature_function_alone_gives_no_normals_of_a_flat_square() {
    let cloud = flat_square(15, Some(&mut Random(8)));
    for (family, length_scale) in FAMILIES {
        let request = GeometryRequest { model: SurfaceModel::Signature, ..CURVATURES };
        let geometry = geometry(&surface_of(&cloud, family, length_scale), &request);
        assert!(geometry.is_null().iter().all(|&is_null| is_null), "{family:?}");
    }
}

#[test]
fn a_plane_with_a_bump_has_normals_on_one_side() {
    let cloud = graph(25, |x, y| 0.3 * (-8.0 * (x * x + y * y)).exp());
    for (family, length_scale) in FAMILIES {
        let surface = surface_of(&cloud, family, 0.5 * length_scale);
        let found = cosines(&geometry(&surface, &CURVATURES), &cloud.normals);
        let wrong = n_wrong(&found);
        assert!(
            wrong == 0 || wrong == found.len(),
            "{family:?}: {wrong} of {} on the other side",
            found.len()
        );
        assert!(smallest_cosine(&found) > 0.99, "{family:?}: {}", smallest_cosine(&found));
    }
}

/// Compares curvatures without a flag to exact ones for outward normals, relative to the larger exact one.
fn check_curvatures(cloud: &OrientedCloud, exact: [f64; 2], share_unflagged: f64, label: &str) {
    for (family, length_scale) in FAMILIES {
        let surface = surface_of(cloud, family, length_scale);
        let geometry = geometry(&surface, &CURVATURES);
        let found = cosines(&geometry, &cloud.normals);
        assert_eq!(n_wrong(&found), 0, "{label}, {family:?}");
        assert!(smallest_cosine(&found) > 0.9, "{label}, {family:?}: {}", smallest_cosine(&found));
        let principal = geometry.curvatures(&Unobserved).unwrap().principal;
        let flags: Vec<usize> = geometry.flags().iter().map(|entry| entry.query).collect();
        for query in (0..geometry.n_queries()).filter(|query| !flags.contains(query)) {
            for (k, exact_k) in principal[query * 2..][..2].iter().zip(exact) {
                assert!((k - exact_k).abs() < 0.5 * exact[1], "{label}, {family:?}: {k} at {query}");
            }
        }
        let unflagged = geometry.n_queries() - flags.len();
        assert!(
            unflagged as f64 >= share_unflagged * geometry.n_queries() as f64,
            "{label}, {family:?}: {unflagged} of {} unflagged",
            geometry.n_queries()
        );
    }
}

#[test]
fn cylinders_and_half_spheres_are_right_or_flagged() {
    check_curvatures(&cylinder(32, 30), [0.0, 2.0], 0.8, "cylinder");
    check_curvatures(&half_sphere(500), [1.0, 1.0], 0.8, "half sphere");
}

/// Rescued answers depend neither on the unit nor on the position of the cloud.
#[test]
fn rescued_answers_scale_and_move_with_the_cloud() {
    let cloud = flat_square(12, Some(&mut Random(9)));
    let saddle = graph(15, |x, y| 0.5 * (x * x - y * y));
    for (oriented, curvature) in [(&cloud, 0.0), (&saddle, 1.0)] {
        for (scale, shift) in [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e4)] {
            let points: Vec<f64> = oriented.points.iter().map(|x| scale * x + shift).collect();
            let middle = oriented.normals.len() / 2;
            let query = Cloud::new(points[middle * 3..][..3].to_vec(), 3).unwrap();
            let surface = surface(&points, 3, Family::Gauss, scale, 1e-10);
            let geometry = Geometry::of(&surface, &query, &CURVATURES, &Unobserved).unwrap();
            let principal = geometry.curvatures(&Unobserved).unwrap().principal;
            // Shifted by 1e4, coordinates have 12 digits left, and second differences over
            // a spacing of 0.1 have ten.
            let tolerance = if shift == 0.0 { 5e-3 } else { 2e-2 };
            let along = geometry.normal(0)[2].signum() * oriented.normals[middle][2].signum();
            for (k, sign) in principal.iter().zip([-1.0, 1.0]) {
                let error = (k * scale - sign * curvature).abs();
                assert!(error < tolerance, "scale {scale}, shift {shift}: {k}, side {along}");
            }
            assert!(geometry.flags().is_empty(), "scale {scale}, shift {shift}");
        }
    }
}

#[test]
fn beyond_the_admitted_work_answers_are_null() {
    let cloud = flat_square(12, None);
    let surface = surface_of(&cloud, Family::Gauss, 1.0);
    let geometry = geometry(&surface, &GeometryRequest { max_offsets: 10, ..CURVATURES });
    assert!(geometry.is_null().iter().enumerate().all(|(query, &is_null)| is_null == (query >= 10)));
    let reasons: Vec<FlagReason> = geometry.flags().iter().map(|entry| entry.reason).collect();
    assert_eq!(reasons, [FlagReason::UnaffordableRescue; 134]);
}

/// Normals of `Orientation::Gradient` point inward here, whichever function answers.
#[test]
fn the_gradient_side_of_the_offset_model_is_that_of_the_signature_function() {
    let cloud = half_sphere(300);
    let surface = surface_of(&cloud, Family::Laplace { epsilon: 1.0 }, 0.7);
    for model in [SurfaceModel::Signature, SurfaceModel::Auto, SurfaceModel::Offset] {
        let request = GeometryRequest { orientation: Orientation::Gradient, model, ..CURVATURES };
        let geometry = geometry(&surface, &request);
        let inward =
            cosines(&geometry, &cloud.normals).iter().flatten().filter(|&&cosine| cosine < -0.9).count();
        let answered = geometry.is_null().iter().filter(|&&is_null| !is_null).count();
        assert!(inward == answered && answered > 290, "{model:?}: {inward} of {answered}");
        let principal = geometry.curvatures(&Unobserved).unwrap().principal;
        let flagged: Vec<usize> = geometry.flags().iter().map(|entry| entry.query).collect();
        let unflagged = (0..300).filter(|query| !flagged.contains(query));
        for query in unflagged {
            assert!(principal[query * 2..][..2].iter().all(|k| (k + 1.0).abs() < 0.3), "{model:?}, {query}");
        }
        assert!(flagged.len() < 60, "{model:?}: {} flagged", flagged.len());
    }
}
