//! Meshes of level sets: topology, distances to known surfaces, shape of triangles, and refusals.

mod bodies;
#[path = "../common/mod.rs"]
mod common;
mod support;

use common::clouds::{circle, fibonacci_sphere, noisy, random_torus, square_grid};
use common::fits::{default_kernel_and_alpha, factorize, fit, kernel, surface};
use common::random::Random;
use gramian_numerics::error::NumericsError;
use gramian_numerics::kernel::Family;
use gramian_numerics::kernel::defaults::Purpose;
use gramian_numerics::mesh::field::{Feet, Field};
use gramian_numerics::mesh::fields::interpolant::LevelOf;
use gramian_numerics::mesh::surface::{MeshOptions, mesh_of_level, mesh_of_surface};
use gramian_numerics::mesh::{Bounds, LevelSetRequest, Quality, Support, level_set};
use gramian_numerics::observer::{Observer, Unobserved};
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest, Orientation, SurfaceModel};
use support::{OPTIONS, angles, assert_is_manifold, bunny, local, meshed, spacing_of, volume};

const WITH_DEVIATIONS: GeometryRequest = GeometryRequest {
    has_edge_normals: false,
    orientation: Orientation::Outward,
    model: SurfaceModel::Auto,
    checks_curvatures: false,
    max_offsets: 0,
    has_deviations: true,
};

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// Distance to the torus (2, ½) of the paper.
fn off_torus(x: &[f64]) -> f64 {
    let ring = x[0].hypot(x[1]) - 2.0;
    (ring.hypot(x[2]) - 0.5).abs()
}

#[test]
fn the_torus_of_gauss_is_a_torus() {
    let cloud = random_torus(700, &mut Random(3));
    let of_gauss = surface(&factorize(&cloud, kernel(Family::Gauss, 1.0), 1e-12));
    for quality in [Quality::Raw, Quality::Regular] {
        let (found, closedness) =
            mesh_of_surface(&of_gauss, &MeshOptions { quality, ..OPTIONS }, &Unobserved).unwrap();
        assert!(closedness.share > 0.9 && !closedness.is_turned, "{closedness:?}");
        assert_eq!((found.quality, found.parts.len(), found.dropped.len()), (quality, 1, 0));
        assert_eq!((found.parts[0].euler_characteristic, found.parts[0].n_boundary_edges), (0, 0));
        assert_is_manifold(&found.mesh);
        let worst = found.mesh.vertices.chunks_exact(3).map(off_torus).fold(0.0, f64::max);
        assert!(worst < 1e-4, "{worst:e}");
        assert!(found.residuals.iter().all(|residual| *residual < 1e-8));
        // 2π²Rr², from below, because the triangles are chords.
        let expected = 2.0 * std::f64::consts::PI.powi(2) * 2.0 * 0.25;
        assert!((0.97..1.0).contains(&(volume(&found.mesh) / expected)), "{}", volume(&found.mesh));
        if quality == Quality::Regular {
            let angles = angles(&found.mesh);
            let n_small = angles.iter().filter(|angle| **angle < 30.0).count();
            assert!(angles[0] > 15.0 && n_small * 100 < angles.len(), "{} {n_small}", angles[0]);
        }
    }
}

#[test]
fn normals_are_outward() {
    let (found, _) = meshed(&local(fibonacci_sphere(800)), &OPTIONS);
    for (x, normal) in found.mesh.vertices.chunks_exact(3).zip(found.normals.chunks_exact(3)) {
        let along: f64 = x.iter().zip(normal).map(|(x, n)| x * n).sum();
        assert!(along > 0.99, "{along}");
        assert!((x.iter().map(|c| c * c).sum::<f64>().sqrt() - 1.0).abs() < 1e-3);
    }
    assert!(found.support.iter().all(|support| *support == Support::Observed));
}

#[test]
fn two_bodies_are_two_parts() {
    let one = fibonacci_sphere(500);
    let moved = |by: f64| one.points().flat_map(move |x| [x[0] + by, x[1], x[2]]).collect::<Vec<f64>>();
    let cloud = Cloud::new([moved(0.0), moved(2.6)].concat(), 3).unwrap();
    let (found, _) = meshed(&local(cloud), &OPTIONS);
    assert_eq!(found.parts.iter().map(|part| part.euler_characteristic).collect::<Vec<_>>(), [2, 2]);
}

#[test]
fn linked_tori_are_two_parts_with_a_hole_each() {
    let one = random_torus(1500, &mut Random(11));
    let linked = one.points().flat_map(|x| [x[0] + 2.0, x[2], x[1]]);
    let points: Vec<f64> = one.coordinates().iter().copied().chain(linked).collect();
    let (found, _) = meshed(&local(Cloud::new(points, 3).unwrap()), &OPTIONS);
    assert_eq!(found.parts.iter().map(|part| part.euler_characteristic).collect::<Vec<_>>(), [0, 0]);
    assert_is_manifold(&found.mesh);
}

/// Points of a closed body, with its Euler characteristic and the distance of any place from its surface.
struct Body<'a> {
    points: &'a Cloud,
    characteristic: i64,
    /// Noise, in spacings, up to which the mesh has this characteristic. Noise of a spacing is a fifth of the
    /// tube of the torus.
    known_up_to: f64,
    off: &'a dyn Fn(&[f64]) -> f64,
}

impl Body<'_> {
    /// Meshes the points with noise of so many spacings. Returns the share of the vertices whose distance
    /// from the truth is within 1.96 of their deviations.
    fn share_within(&self, spacings: f64) -> f64 {
        let surface = local(noisy(self.points, spacings * spacing_of(self.points), &mut Random(13)));
        let (found, _) = meshed(&surface, &OPTIONS);
        if spacings <= self.known_up_to {
            let characteristics: Vec<i64> =
                found.parts.iter().map(|part| part.euler_characteristic).collect();
            assert_eq!(characteristics, [self.characteristic], "noise of {spacings} spacings");
        }
        let vertices = Cloud::new(found.mesh.vertices.clone(), 3).unwrap();
        let geometry = Geometry::of(&surface, &vertices, &WITH_DEVIATIONS, &Unobserved).unwrap();
        let known = geometry.deviations().unwrap();
        let rows = vertices.points().zip(&known.height).zip(&known.is_known);
        let within: Vec<bool> = rows
            .filter(|(_, is_known)| **is_known)
            .map(|((x, deviation), _)| (self.off)(x) <= 1.96 * deviation)
            .collect();
        within.iter().filter(|is_within| **is_within).count() as f64 / within.len() as f64
    }
}

#[test]
fn vertices_are_as_near_to_the_truth_as_their_deviations_say() {
    let off_sphere = |x: &[f64]| (norm(x) - 1.0).abs();
    // To first order: |F|/|∇F| of F = x² + 4y² + 4z² − 4.
    let off_ellipsoid = |x: &[f64]| {
        let value = x[0] * x[0] + 4.0 * (x[1] * x[1] + x[2] * x[2]) - 4.0;
        value.abs() / norm(&[2.0 * x[0], 8.0 * x[1], 8.0 * x[2]])
    };
    let sphere = fibonacci_sphere(2000);
    let ellipsoid = Cloud::new(sphere.points().flat_map(|x| [2.0 * x[0], x[1], x[2]]).collect(), 3).unwrap();
    let torus = random_torus(3000, &mut Random(12));
    let bodies = [
        Body { points: &sphere, characteristic: 2, known_up_to: 1.0, off: &off_sphere },
        Body { points: &ellipsoid, characteristic: 2, known_up_to: 1.0, off: &off_ellipsoid },
        Body { points: &torus, characteristic: 0, known_up_to: 0.5, off: &off_torus },
    ];
    for (body, spacings) in bodies.iter().flat_map(|body| [(body, 0.5), (body, 1.0)]) {
        let share = body.share_within(spacings);
        // Positions are weighed as normals are, level by level, which makes their bars a little long.
        assert!((0.9..=0.998).contains(&share), "noise of {spacings} spacings: {share}");
    }
}

#[test]
fn normals_of_noisy_points_are_outward() {
    let torus = random_torus(3000, &mut Random(12));
    for spacings in [0.25, 0.5, 0.75, 1.0] {
        let cloud = noisy(&torus, spacings * spacing_of(&torus), &mut Random(13));
        let geometry = Geometry::of(&local(cloud.clone()), &cloud, &WITH_DEVIATIONS, &Unobserved).unwrap();
        let is_inward = |(x, normal): (&[f64], &[f64])| {
            let ring = 2.0 / x[0].hypot(x[1]);
            let outward = [x[0] * (1.0 - ring), x[1] * (1.0 - ring), x[2]];
            outward.iter().zip(normal).map(|(a, b)| a * b).sum::<f64>() < 0.0
        };
        let n_inward =
            cloud.points().zip(geometry.normals().chunks_exact(3)).filter(|row| is_inward(*row)).count();
        assert!(n_inward <= 45, "noise of {spacings} spacings: {n_inward} of 3000");
    }
}

#[test]
fn a_level_is_found_wherever_it_separates_points() {
    // Two bumps in a cube of points: the level ½ is a closed surface around each.
    let bump = |x: &[f64], at: f64| (-12.0 * ((x[0] - at).powi(2) + x[1] * x[1] + x[2] * x[2])).exp();
    let axis = |k: usize| -1.5 + 0.2 * k as f64;
    let points: Vec<f64> =
        (0..16 * 8 * 8).flat_map(|i| [axis(i % 16), axis(i / 16 % 8) + 0.8, axis(i / 128) + 0.8]).collect();
    let cloud = Cloud::new(points, 3).unwrap();
    let values: Vec<f64> = cloud.points().map(|x| bump(x, -0.8) + bump(x, 0.8)).collect();
    let function = fit(&factorize(&cloud, kernel(Family::Gauss, 0.5), 1e-10), &values);
    let found = mesh_of_level(LevelOf::new(&function, 0.5, 1.0), &OPTIONS, &Unobserved).unwrap();
    assert_eq!(found.parts.iter().map(|part| part.euler_characteristic).collect::<Vec<_>>(), [2, 2]);
    let radius = (2.0_f64.ln() / 12.0).sqrt();
    for x in found.mesh.vertices.chunks_exact(3) {
        let centre = 0.8 * x[0].signum();
        assert!((norm(&[x[0] - centre, x[1], x[2]]) - radius).abs() < 0.02, "{x:?}");
    }
}

#[test]
fn a_curve_is_a_closed_polyline() {
    let (found, _) = meshed(&local(circle(60)), &OPTIONS);
    assert_eq!((found.parts.len(), found.parts[0].euler_characteristic), (1, 0));
    assert!((found.parts[0].area / std::f64::consts::TAU - 1.0).abs() < 0.01, "{:?}", found.parts);
    for segment in found.mesh.cells() {
        let [a, b] = [found.mesh.vertex(segment[0]), found.mesh.vertex(segment[1])];
        assert!(a[0] * b[1] - a[1] * b[0] > 0.0, "segments run counter-clockwise around the inside");
    }
}

#[test]
fn few_points_are_a_closed_polyline_too() {
    for n in [8, 12, 16] {
        let cloud = circle(n);
        let (kernel, alpha) = default_kernel_and_alpha(&cloud, Purpose::LevelSets);
        let (found, closedness) = meshed(&surface(&factorize(&cloud, kernel, alpha)), &OPTIONS);
        assert!(closedness.share > 0.9, "{n} points: {closedness:?}");
        assert_eq!((found.parts.len(), found.parts[0].euler_characteristic), (1, 0), "{n} points");
    }
}

#[test]
fn the_bunny_is_one_closed_part() {
    let (cloud, spacing) = bunny();
    let (kernel, alpha) = default_kernel_and_alpha(&cloud, Purpose::LevelSets);
    let (found, closedness) = meshed(&surface(&factorize(&cloud, kernel, alpha)), &OPTIONS);
    assert_eq!((found.parts.len(), found.parts[0].euler_characteristic), (1, 2), "{:?}", found.parts);
    assert!(closedness.share > 0.9, "{closedness:?}");
    assert_is_manifold(&found.mesh);
    // Vertices lie on the level.
    let mean = found.residuals.iter().sum::<f64>() / found.residuals.len() as f64;
    assert!(mean < 0.01 * spacing, "{mean}");
}

#[test]
fn noise_does_not_tear_the_surface() {
    let cloud = noisy(&fibonacci_sphere(2000), 0.02, &mut Random(5));
    let (found, _) = meshed(&local(cloud), &OPTIONS);
    assert_eq!(found.parts.iter().map(|part| part.euler_characteristic).collect::<Vec<_>>(), [2]);
}

#[test]
fn a_hole_is_bridged_and_said() {
    let whole = fibonacci_sphere(2000);
    let points: Vec<f64> = whole.points().filter(|x| x[2] < 0.9).flatten().copied().collect();
    let (found, _) = meshed(&local(Cloud::new(points, 3).unwrap()), &OPTIONS);
    assert_eq!((found.parts[0].euler_characteristic, found.parts[0].n_boundary_edges), (2, 0));
    let bridged = found.support.iter().zip(found.mesh.vertices.chunks_exact(3));
    let mut n_bridged = 0;
    for (_, x) in bridged.filter(|(support, _)| **support == Support::Bridged) {
        assert!(x[2] > 0.85, "{x:?}");
        n_bridged += 1;
    }
    // The hole is 11 spacings wide, and two at its rim count as observed: 38 squares of a spacing are left.
    assert!(n_bridged > 20, "{n_bridged}");
}

#[test]
fn an_open_sheet_is_refused_unless_it_may_be_open() {
    let sheet: Vec<f64> = square_grid(30).points().flat_map(|x| [x[0], x[1], 0.1 * x[0] * x[0]]).collect();
    let sheet = local(Cloud::new(sheet, 3).unwrap());
    let refused = mesh_of_surface(&sheet, &OPTIONS, &Unobserved).map(|_| ());
    assert!(matches!(refused, Err(NumericsError::OpenSurface { .. })), "{refused:?}");
    let (found, _) = meshed(&sheet, &MeshOptions { is_open: true, ..OPTIONS });
    assert_eq!((found.parts.len(), found.parts[0].euler_characteristic), (1, 1), "{:?}", found.parts);
    assert!(found.parts[0].n_boundary_edges > 20);
}

#[test]
fn a_level_of_values_ends_at_the_bounds() {
    // u = x over a grid: its level ½ is the line x = ½.
    let cloud = square_grid(24);
    let values: Vec<f64> = cloud.points().map(|x| x[0]).collect();
    let function = fit(&factorize(&cloud, kernel(Family::Matern { order: 2 }, 1.0), 1e-10), &values);
    let bounds = Some(Bounds { min: vec![0.0, 0.0], max: vec![1.0, 1.0] });
    let options = MeshOptions { bounds, ..OPTIONS };
    let found = mesh_of_level(LevelOf::new(&function, 0.5, 1.0), &options, &Unobserved).unwrap();
    assert_eq!(
        (found.parts.len(), found.parts[0].euler_characteristic, found.parts[0].n_boundary_edges),
        (1, 1, 2)
    );
    assert!(found.mesh.vertices.chunks_exact(2).all(|x| (x[0] - 0.5).abs() < 1e-3));
    // Outward is where u falls.
    assert!(found.normals.chunks_exact(2).all(|normal| normal[0] < -0.99));
}

#[test]
#[expect(clippy::disallowed_methods, reason = "a test may wait for another pool")]
fn the_mesh_does_not_depend_on_the_number_of_threads() {
    let sphere = local(fibonacci_sphere(400));
    let mesh_on = |n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
        pool.install(|| meshed(&sphere, &OPTIONS).0)
    };
    let one = mesh_on(1);
    for n_threads in [2, 16] {
        let other = mesh_on(n_threads);
        assert_eq!(one.mesh, other.mesh);
        assert_eq!((&one.normals, &one.residuals), (&other.normals, &other.residuals));
    }
}

#[test]
fn a_step_too_short_is_refused() {
    let sphere = local(fibonacci_sphere(300));
    // From too many nodes to coordinates beyond an i64.
    for step in [1e-4, 1e-7, 1e-140] {
        let options = MeshOptions { step: Some(step), max_nodes: 100_000, ..OPTIONS };
        let refused = mesh_of_surface(&sphere, &options, &Unobserved).map(|_| ());
        assert_eq!(refused, Err(NumericsError::TooManyNodes { limit: 100_000 }), "{step}");
    }
}

#[test]
fn units_and_offsets_change_nothing() {
    let own = fibonacci_sphere(400);
    let moved = |scale: f64, offset: f64| {
        Cloud::new(own.coordinates().iter().map(|x| scale * x + offset).collect(), 3).unwrap()
    };
    let counts = |cloud: Cloud| {
        let (found, _) = meshed(&local(cloud), &OPTIONS);
        (found.parts.len(), found.parts[0].euler_characteristic, found.parts[0].n_boundary_edges)
    };
    for (scale, offset) in [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e5)] {
        assert_eq!(counts(moved(scale, offset)), (1, 2, 0), "{scale} {offset}");
    }
}

#[test]
fn cancellation_is_honoured() {
    struct Gone;
    impl gramian_numerics::observer::Observer for Gone {
        fn enter(&self, _: gramian_numerics::observer::Stage) {}
        fn is_cancelled(&self) -> bool {
            true
        }
    }
    let sphere = local(fibonacci_sphere(300));
    assert_eq!(mesh_of_surface(&sphere, &OPTIONS, &Gone).map(|_| ()), Err(NumericsError::Cancelled));
}

/// The unit sphere with a small sphere beside it: f = max(1 − |x|, 0.15 − |x − c|).
struct SphereWithBubble;

impl SphereWithBubble {
    const BUBBLE: [f64; 3] = [0.0, 0.0, 1.25];

    fn jet(x: &[f64]) -> (f64, Vec<f64>) {
        let to_bubble: Vec<f64> = x.iter().zip(Self::BUBBLE).map(|(x, c)| x - c).collect();
        let (of_sphere, of_bubble) = (1.0 - norm(x), 0.15 - norm(&to_bubble));
        let (value, from_centre) =
            if of_sphere > of_bubble { (of_sphere, x) } else { (of_bubble, &to_bubble[..]) };
        (value, from_centre.iter().map(|c| c / norm(from_centre)).collect())
    }
}

impl Field for SphereWithBubble {
    fn dimension(&self) -> usize {
        3
    }

    fn values_at_once(&self, places: &[f64], _: &dyn Observer) -> Result<Vec<f64>, NumericsError> {
        Ok(places.chunks_exact(3).map(|x| Self::jet(x).0).collect())
    }

    fn feet_at_once(&self, places: &[f64], _: &dyn Observer) -> Result<Feet, NumericsError> {
        let mut feet = Feet::default();
        for x in places.chunks_exact(3) {
            let (value, normal) = Self::jet(x);
            feet.positions.extend(x.iter().zip(&normal).map(|(x, c)| x + value * c));
            feet.normals.extend(normal);
            feet.distances.push(value.abs());
        }
        Ok(feet)
    }

    fn tolerance(&self) -> f64 {
        1e-12
    }
}

#[test]
fn a_bubble_beside_a_surface_has_no_points_of_its_own_and_is_dropped() {
    let mesh_over = |points: Vec<f64>| {
        let cloud = Cloud::new(points, 3).unwrap();
        let sampling = Sampling::of(&cloud, &Unobserved).unwrap();
        let seeds = |points: std::ops::Range<usize>, _: &dyn Observer| {
            Ok([&cloud.coordinates()[3 * points.start..3 * points.end], &[0.0, 0.0, 1.4]].concat())
        };
        let request = LevelSetRequest {
            field: &SphereWithBubble,
            sampling: &sampling,
            seeds: &seeds,
            step: sampling.scales().spacing,
            bounds: Bounds { min: vec![-2.0; 3], max: vec![2.0; 3] },
            is_open: false,
            quality: Quality::Regular,
            max_nodes: 2_000_000,
        };
        level_set(&request, &Unobserved).unwrap()
    };
    let sphere = fibonacci_sphere(2000).coordinates().to_vec();
    let found = mesh_over(sphere.clone());
    // The bubble is a spacing and a quarter away from the points, and has the area of 40 of them.
    assert_eq!((found.parts.len(), found.dropped.len()), (1, 1));
    assert!((0.2..0.3).contains(&found.dropped[0].area), "{:?}", found.dropped);
    // With points of its own it is a part.
    let bubble = fibonacci_sphere(60);
    let on_bubble =
        bubble.points().flat_map(|x| [0.15 * x[0], 0.15 * x[1], 0.15 * x[2] + SphereWithBubble::BUBBLE[2]]);
    let found = mesh_over(sphere.into_iter().chain(on_bubble).collect());
    assert_eq!((found.parts.len(), found.dropped.len()), (2, 0));
}
