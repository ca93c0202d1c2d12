//! Signs of clouds whose sides are known.

use super::consistent::{Signs, consistent_signs};
use super::{CloudWithNeighbours, Directions};
use crate::observer::Unobserved;
use crate::points::cloud::Cloud;
use crate::points::neighbourhoods::Neighbourhoods;
use crate::points::sampling::Sampling;
use crate::testing::{Random, fibonacci_sphere};

fn signs_of(cloud: &Cloud, directions: &Directions) -> Signs {
    let sampling = Sampling::of(cloud, &Unobserved).unwrap();
    let around = Neighbourhoods::of(sampling.neighbours(), cloud, 18, &Unobserved).unwrap();
    let sampled = CloudWithNeighbours { cloud, sampling: &sampling, around: &around, observer: &Unobserved };
    consistent_signs(&sampled, directions, false).unwrap()
}

fn directions(cloud: &Cloud, normals: Vec<f64>) -> Directions {
    let n = cloud.n_points();
    Directions { normals, has_sign: vec![true; n], is_at_rim: vec![false; n] }
}

#[test]
fn a_flipped_region_of_a_sphere_is_turned_back() {
    let cloud = fibonacci_sphere(400);
    for (height, expected) in [(0.3, 140), (-0.4, 280)] {
        // Normals point inward above the height: on less than half of the sphere, and on more.
        let sign = |x: &[f64]| if x[2] > height { -1.0 } else { 1.0 };
        let normals = cloud.points().flat_map(|x| x.iter().map(|c| sign(x) * c).collect::<Vec<_>>());
        let directions = directions(&cloud, normals.collect());
        let signs = signs_of(&cloud, &directions);
        assert_eq!(signs.n_flipped, expected);
        assert!(cloud.points().zip(&signs.signs).all(|(x, &s)| s == sign(x)));
        assert!(!signs.is_open);
    }
}

#[test]
fn the_sides_of_a_thin_sheet_keep_their_opposite_signs() {
    // Two layers at a distance of half the spacing.
    let layer = |z: f64| (0..100).flat_map(move |i| [(i % 10) as f64, (i / 10) as f64, z]);
    let cloud = Cloud::new(layer(0.0).chain(layer(0.5)).collect(), 3).unwrap();
    let normals = (0..200).flat_map(|i| [0.0, 0.0, if i < 100 { -1.0 } else { 1.0 }]).collect();
    let signs = signs_of(&cloud, &directions(&cloud, normals));
    assert_eq!(signs.n_flipped, 0);
}

#[test]
fn points_without_a_sign_follow_their_neighbours() {
    let cloud = fibonacci_sphere(300);
    let normals = cloud
        .points()
        .enumerate()
        .flat_map(|(i, x)| x.iter().map(move |c| if i % 3 == 0 { -c } else { *c }).collect::<Vec<_>>())
        .collect();
    let mut directions = directions(&cloud, normals);
    directions.has_sign = (0..300).map(|i| i % 3 != 0).collect();
    let signs = signs_of(&cloud, &directions);
    assert_eq!(signs.n_flipped, 0);
    assert!(signs.signs.iter().enumerate().all(|(i, &s)| s == if i % 3 == 0 { -1.0 } else { 1.0 }));
}

/// Returns n random points of the curve r = 1 + cos(5t)/2, and their outward unit normals.
fn random_star(n: usize) -> (Cloud, Vec<f64>) {
    let (mut points, mut normals, mut random) = (Vec::new(), Vec::new(), Random(3));
    for _ in 0..n {
        let t = random.angle();
        let ((s, c), r, slope) = (t.sin_cos(), 1.0 + 0.5 * (5.0 * t).cos(), -2.5 * (5.0 * t).sin());
        points.extend([r * c, r * s]);
        let length = r.hypot(slope);
        normals.extend([(r * c + slope * s) / length, (r * s - slope * c) / length]);
    }
    (Cloud::new(points, 2).unwrap(), normals)
}

#[test]
fn a_curve_is_one_piece_across_its_gaps() {
    let (cloud, normals) = random_star(3000);
    // Gradients follow the curvature: they point inward on the five concave parts.
    let is_concave = |x: &[f64]| x[0].hypot(x[1]) < 0.8;
    let turned = cloud.points().zip(normals.chunks_exact(2));
    let turned = turned.flat_map(|(x, n)| n.iter().map(move |c| if is_concave(x) { -c } else { *c }));
    let signs = signs_of(&cloud, &directions(&cloud, turned.collect()));
    assert!(cloud.points().zip(&signs.signs).all(|(x, &s)| s == if is_concave(x) { -1.0 } else { 1.0 }));
    assert!(!signs.is_open && !signs.is_ambiguous.contains(&true));
}

#[test]
fn winding_numbers_tell_the_sides_of_a_plate_apart() {
    // Gradients of a function that is too smooth to see both sheets all point upward.
    let layer = |z: f64| (0..400).flat_map(move |i| [f64::from(i % 20), f64::from(i / 20), z]);
    let cloud = Cloud::new(layer(0.0).chain(layer(1.5)).collect(), 3).unwrap();
    let normals = (0..800).flat_map(|_| [0.0, 0.0, 1.0]).collect();
    let signs = signs_of(&cloud, &directions(&cloud, normals));
    assert!(cloud.points().zip(&signs.signs).all(|(x, &s)| s == if x[2] == 0.0 { -1.0 } else { 1.0 }));
}

#[test]
fn open_surfaces_keep_the_side_of_their_gradients_without_a_doubt() {
    let sphere = fibonacci_sphere(1000);
    let cap: Vec<f64> = sphere.points().filter(|x| x[2] > 0.2).flatten().copied().collect();
    let cap = Cloud::new(cap, 3).unwrap();
    let flat = Cloud::new((0..400).flat_map(|i| [f64::from(i % 20), f64::from(i / 20), 0.0]).collect(), 3);
    let flat = flat.unwrap();
    for sign in [1.0, -1.0] {
        let mut open = directions(&cap, cap.coordinates().iter().map(|c| sign * c).collect());
        open.is_at_rim = cap.points().map(|x| x[2] < 0.3).collect();
        let found = signs_of(&cap, &open);
        assert!(found.n_flipped == 0 && !found.is_ambiguous.contains(&true));
        let normals = (0..400).flat_map(|_| [0.0, 0.0, sign]).collect();
        let found = signs_of(&flat, &directions(&flat, normals));
        assert!(found.n_flipped == 0 && !found.is_ambiguous.contains(&true));
    }
}
