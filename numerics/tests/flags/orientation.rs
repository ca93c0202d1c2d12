//! Signs of normals where the signature function alone flips them.

use gramian_numerics::kernel::Family;
use gramian_numerics::surface::geometry::{GeometryRequest, SurfaceModel};

use super::clouds::{OrientedCloud, closed_curve, dumbbell, half_sphere, plate};
use super::support::{cosines, geometry, n_wrong, surface_of};

const NORMALS: GeometryRequest = GeometryRequest { checks_curvatures: false, ..GeometryRequest::CURVATURES };

fn n_wrong_signs(
    cloud: &OrientedCloud,
    family: Family,
    length_scale: f64,
    request: &GeometryRequest,
) -> (usize, usize) {
    let surface = surface_of(cloud, family, length_scale);
    let found = cosines(&geometry(&surface, request), &cloud.normals);
    (n_wrong(&found), found.iter().filter(|cosine| cosine.is_none()).count())
}

#[test]
fn the_closed_curve_has_no_wrong_sign() {
    let cloud = closed_curve(64);
    for length_scale in [0.5, 0.3, 0.1] {
        for model in [SurfaceModel::Signature, SurfaceModel::Auto] {
            let request = GeometryRequest { model, ..NORMALS };
            let (n_wrong, n_null) = n_wrong_signs(&cloud, Family::Gauss, length_scale, &request);
            assert_eq!(n_wrong, 0, "ℓ = {length_scale}");
            assert!(model == SurfaceModel::Signature || n_null == 0, "ℓ = {length_scale}: {n_null} null");
        }
    }
}

#[test]
fn the_dumbbell_has_no_wrong_sign() {
    for n in [400, 1000] {
        let cloud = dumbbell(n);
        let families = [Family::Gauss, Family::Laplace { epsilon: 1.0 }, Family::Matern { order: 2 }];
        for family in families {
            for length_scale in [0.15, 0.3, 0.6] {
                let surface = surface_of(&cloud, family, length_scale);
                let found = cosines(&geometry(&surface, &NORMALS), &cloud.normals);
                assert_eq!(n_wrong(&found), 0, "{n} points, {family:?}, ℓ = {length_scale}");
                assert!(!surface.orientation().is_open);
            }
        }
        // The repair has something to do: more than a twentieth of the points were flipped.
        let narrow = surface_of(&cloud, Family::Gauss, 0.3);
        assert!(narrow.orientation().n_flipped * 20 > n, "{:?}", narrow.orientation());
    }
}

#[test]
fn the_sides_of_a_thin_plate_point_apart() {
    // Thickness from half a spacing (0.1) up to three spacings.
    for thickness in [0.05, 0.1, 0.3] {
        let cloud = plate(21, thickness);
        for family in [Family::Gauss, Family::Laplace { epsilon: 1.0 }] {
            let surface = surface_of(&cloud, family, 0.5);
            let found = cosines(&geometry(&surface, &NORMALS), &cloud.normals);
            assert_eq!(n_wrong(&found), 0, "{family:?}, thickness {thickness}");
        }
    }
}

#[test]
fn an_open_half_sphere_is_called_open_and_points_away_from_its_centre() {
    let cloud = half_sphere(400);
    for family in [Family::Gauss, Family::Laplace { epsilon: 1.0 }, Family::Matern { order: 2 }] {
        let surface = surface_of(&cloud, family, 0.7);
        assert!(surface.orientation().is_open);
        let found = cosines(&geometry(&surface, &NORMALS), &cloud.normals);
        assert_eq!(n_wrong(&found), 0, "{family:?}");
    }
}
