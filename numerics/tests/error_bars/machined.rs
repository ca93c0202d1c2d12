//! Flags of curvatures on machined parts: planes beside fillets.

use std::sync::Arc;

use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest};
use gramian_numerics::surface::local::{Given, LocalSurface};

use crate::common::random::Random;

/// Half extents of the planes of a rounded box, and the radius of its fillets.
const HALF: [f64; 3] = [1.0, 0.7, 0.5];
const FILLET: f64 = 0.3;

/// A point of the surface, with its distance to the next fillet if it lies on a plane.
struct Placed {
    position: [f64; 3],
    to_fillet: Option<f64>,
}

/// Random points of a rounded box, uniform in area: points of a thin shell, moved onto the surface.
fn rounded_box(n: usize, random: &mut Random) -> Vec<Placed> {
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
        points.push(Placed { position, to_fillet });
    }
    points
}

/// Returns which curvatures of a cloud with noise (L) have a flag.
fn flagged(points: impl Iterator<Item = [f64; 3]>, noise: f64, random: &mut Random) -> Vec<bool> {
    let coordinates = points.flatten().map(|x| x + noise * random.normal()).collect();
    let cloud = Arc::new(Cloud::new(coordinates, 3).unwrap());
    let sampling = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
    let local = LocalSurface::of(cloud.clone(), sampling, Given::default(), &Unobserved).unwrap();
    let request = GeometryRequest { has_deviations: true, ..GeometryRequest::CURVATURES };
    let geometry = Geometry::of(&Surface::from(local), &cloud, &request, &Unobserved).unwrap();
    let mut flagged = vec![false; cloud.n_points()];
    geometry.degenerate().iter().for_each(|flag| flagged[flag.query] = true);
    flagged
}

#[test]
fn planes_far_from_fillets_have_no_flag() {
    // Planes have 4 (0.35 + 0.5 + 0.7) of twice their area, fillets π/2 · 0.3 · 8 · 2.2, corners 4π · 0.09.
    let area: f64 = 12.4 + 8.29 + 1.13;
    for (n, noise) in [(6_000, 0.0), (6_000, 0.05), (20_000, 0.05)] {
        let (mut random, spacing) = (Random(1), (area / n as f64).sqrt());
        let points = rounded_box(n, &mut random);
        let flagged = flagged(points.iter().map(|of| of.position), noise * spacing, &mut random);
        let is_far = |of: &Placed| of.to_fillet.is_some_and(|distance| distance > 6.0 * spacing);
        let far: Vec<bool> =
            points.iter().zip(&flagged).filter(|(of, _)| is_far(of)).map(|(_, flagged)| *flagged).collect();
        let n_flagged = far.iter().filter(|flagged| **flagged).count();
        // All of them had a flag where there is noise: three deviations exceed half of a curvature of 0.
        assert!(far.len() > n / 10, "{n}, {noise}: {}", far.len());
        assert!(20 * n_flagged <= far.len(), "{n}, {noise}: {n_flagged} of {}", far.len());
    }
}

#[test]
fn planes_with_much_noise_have_no_flag() {
    let n = 5_000;
    for noise in [0.05, 0.2, 0.5] {
        let mut random = Random(2);
        let points: Vec<[f64; 3]> = (0..n).map(|_| [random.uniform(), random.uniform(), 0.0]).collect();
        let spacing = (1.0 / n as f64).sqrt();
        let flagged = flagged(points.into_iter(), noise * spacing, &mut random);
        let n_flagged = flagged.iter().filter(|flagged| **flagged).count();
        assert!(20 * n_flagged <= n, "{noise}: {n_flagged}");
    }
}
