//! Curvatures of machined parts, planes beside fillets: their bars and flags.

use std::sync::Arc;

use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest};
use gramian_numerics::surface::local::{LocalInputs, LocalSurface};

use crate::common::random::Random;

/// Half extents of the planes of a rounded box, and the radius of its fillets.
const HALF: [f64; 3] = [1.0, 0.7, 0.5];
const FILLET: f64 = 0.3;

/// A point of the surface, with its distance to the next fillet if it lies on a plane.
struct BoxPoint {
    position: [f64; 3],
    to_fillet: Option<f64>,
    part: usize,
}

/// Parts of a rounded box, and their mean curvatures.
const PLANE: usize = 0;
const MEAN_CURVATURES: [f64; 3] = [0.0, 0.5 / FILLET, 1.0 / FILLET];

/// Planes have 4 (0.35 + 0.5 + 0.7) of twice their area, fillets π/2 · 0.3 · 8 · 2.2, corners 4π · 0.09.
const AREA: f64 = 12.4 + 8.29 + 1.13;

/// Random points of a rounded box, uniform in area: points of a thin shell, moved onto the surface.
fn rounded_box(n: usize, random: &mut Random) -> Vec<BoxPoint> {
    let mut points = Vec::with_capacity(n);
    while points.len() < n {
        let x = HALF.map(|half| (2.0 * random.uniform() - 1.0) * (half + 1.02 * FILLET));
        let inner = [0, 1, 2].map(|c| x[c].clamp(-HALF[c], HALF[c]));
        let arm = [0, 1, 2].map(|c| x[c] - inner[c]);
        let length = arm.iter().map(|a| a * a).sum::<f64>().sqrt();
        if (length - FILLET).abs() > 0.02 * FILLET {
            continue;
        }
        let position = [0, 1, 2].map(|c| inner[c] + FILLET * arm[c] / length);
        let n_beyond = arm.iter().filter(|a| **a != 0.0).count();
        let within = (0..3).filter(|&c| arm[c] == 0.0).map(|c| HALF[c] - x[c].abs());
        let to_fillet = (n_beyond == 1).then(|| within.fold(f64::INFINITY, f64::min));
        points.push(BoxPoint { position, to_fillet, part: n_beyond - 1 });
    }
    points
}

/// Curvatures of a cloud with noise (L).
fn curvatures(points: impl Iterator<Item = [f64; 3]>, noise: f64, random: &mut Random) -> Geometry {
    let coordinates = points.flatten().map(|x| x + noise * random.normal()).collect();
    let cloud = Arc::new(Cloud::new(coordinates, 3).unwrap());
    let sampling = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
    let local = LocalSurface::of(cloud.clone(), sampling, LocalInputs::default(), &Unobserved).unwrap();
    let request = GeometryRequest { has_deviations: true, ..GeometryRequest::CURVATURES };
    Geometry::of(&Surface::from(local), &cloud, &request, &Unobserved).unwrap()
}

/// Share of queries in per cent.
fn percent(n: usize, of: usize) -> f64 {
    100.0 * n as f64 / of as f64
}

/// What a rounded box is answered.
pub struct BoxShares {
    /// Mean curvatures within 1.96 deviations on planes, fillets and corners, per cent.
    pub covered: [f64; 3],
    /// Planes with a flag, farther than six spacings from the next fillet, per cent.
    pub far_flagged: f64,
}

/// Asks for the curvatures of n random points of a rounded box, with noise in spacings.
pub fn rounded_box_answered(n: usize, noise: f64) -> BoxShares {
    let (mut random, spacing) = (Random(1), (AREA / n as f64).sqrt());
    let points = rounded_box(n, &mut random);
    let found = curvatures(points.iter().map(|of| of.position), noise * spacing, &mut random);
    let mean = found.curvatures(&Unobserved).unwrap().mean;
    let deviations = &found.deviations().unwrap().mean;
    let mut flagged = vec![false; n];
    found.flags().iter().for_each(|flag| flagged[flag.query] = true);
    let is_covered =
        |at: &usize| (mean[*at] - MEAN_CURVATURES[points[*at].part]).abs() <= 1.96 * deviations[*at] + 1e-9;
    let covered = [0, 1, 2].map(|part| {
        let own: Vec<usize> = (0..n).filter(|&at| points[at].part == part).collect();
        percent(own.iter().filter(|at| is_covered(at)).count(), own.len())
    });
    let is_far = |at: &usize| points[*at].to_fillet.is_some_and(|distance| distance > 6.0 * spacing);
    let far: Vec<usize> = (0..n).filter(|at| points[*at].part == PLANE && is_far(at)).collect();
    assert!(far.len() > n / 10, "{n}: {}", far.len());
    BoxShares { covered, far_flagged: percent(far.iter().filter(|at| flagged[**at]).count(), far.len()) }
}

#[test]
fn bars_cover_planes_fillets_and_corners() {
    // Per cent of the mean curvatures of exact points that must be covered, and with noise of a twentieth of
    // a spacing. They were 90, 79 and 72 with processes that are too smooth for jumps of curvature.
    for (noise, least) in [(0.0, [88.0; 3]), (0.05, [85.0, 80.0, 76.0])] {
        let BoxShares { covered, far_flagged } = rounded_box_answered(6_000, noise);
        let are_covered = covered.iter().zip(least).all(|(found, least)| (least..99.5).contains(found));
        assert!(are_covered, "{noise}: {covered:?}");
        // All of them had a flag where there is noise: three deviations exceed half of a curvature of 0.
        assert!(far_flagged <= 5.0, "{noise}: {far_flagged}");
    }
}

#[test]
fn planes_far_from_fillets_have_no_flag() {
    let BoxShares { far_flagged, .. } = rounded_box_answered(20_000, 0.05);
    assert!(far_flagged <= 5.0, "{far_flagged}");
}

#[test]
fn planes_with_much_noise_have_no_flag() {
    let n = 5_000;
    for noise in [0.05, 0.2, 0.5] {
        let mut random = Random(2);
        let points: Vec<[f64; 3]> = (0..n).map(|_| [random.uniform(), random.uniform(), 0.0]).collect();
        let spacing = (1.0 / n as f64).sqrt();
        let n_flagged = curvatures(points.into_iter(), noise * spacing, &mut random).flags().len();
        assert!(20 * n_flagged <= n, "{noise}: {n_flagged}");
    }
}
