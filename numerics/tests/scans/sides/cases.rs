//! Named clouds on which the sides of normals are counted.

use std::f64::consts::TAU;

use super::clouds::{
    OrientedCloud, along, cassini, faceted, folded_strip, half_cone, half_lens, half_plate, length_around,
    length_of, polar, revolved, revolved_area, ring, sphere, surface_spacing,
};
use crate::common::random::Random;

/// A cloud, and the distance between its sheets in spacings, infinite for a single sheet.
pub struct Case {
    pub name: String,
    pub sided: OrientedCloud,
    pub thickness: f64,
}

impl Case {
    fn new(name: String, sided: OrientedCloud, thickness: f64) -> Self {
        Self { name, sided, thickness }
    }
}

/// Curves `r = 1 + a cos kt` and ovals of Cassini.
pub fn curves(n: usize, seed: u64) -> Vec<Case> {
    let mut cases = Vec::new();
    for is_random in [true, false] {
        let sampled = |r: &dyn Fn(f64) -> f64| polar(r, n, is_random.then_some(&mut Random(seed + n as u64)));
        let kind = if is_random { "random" } else { "regular" };
        for (a, k) in [(0.3, 3.0), (0.5, 5.0), (0.3, 8.0), (0.7, 2.0)] {
            let name = format!("1 + {a} cos {k}t, {kind}");
            cases.push(Case::new(name, sampled(&|t| 1.0 + a * (k * t).cos()), f64::INFINITY));
        }
        for b in [1.05, 1.01] {
            let name = format!("Cassini {b}, {kind}");
            cases.push(Case::new(name, sampled(&cassini(1.0, b)), f64::INFINITY));
        }
    }
    cases
}

/// The curves of [`curves`] with noise of so many mean distances along them in every direction.
pub fn noisy_curves(n: usize, noise: f64, seed: u64) -> Vec<Case> {
    let mut random = Random(1000 + seed);
    let moved = |Case { name, sided, thickness }| {
        let sigma = noise * length_around(&sided.cloud) / n as f64;
        Case::new(format!("{name}, noise {noise}"), sided.noisy(sigma, &mut random), thickness)
    };
    curves(n, seed).into_iter().map(moved).collect()
}

/// A plane strip folded five times. Its thickness and gaps are `thickness` spacings.
pub fn folded_curve(n: usize, thickness: f64, seed: u64) -> Case {
    let outline_of = |length: f64| folded_strip(1.0, 1.0, 6, length);
    // Both sides of six layers and the ends, n points with a spacing of 1.25 times length over n.
    let wanted = n as f64 / (1.25 * thickness);
    let ends = length_of(&outline_of(1.0)) - 12.0;
    let outline = outline_of(((wanted - ends) / 12.0).max(1.0));
    let n = (1.25 * thickness * length_of(&outline)) as usize;
    Case::new(format!("folded strip, {thickness}"), along(&outline, n, &mut Random(seed)), thickness)
}

/// A ring whose section is a folded strip of `n_layers` layers. Its thickness and gaps
/// are `thickness` spacings.
pub fn folded_sheet(n_layers: usize, thickness: f64, seed: u64) -> Case {
    let mut outline = folded_strip(1.0, 1.0, n_layers, 2.0);
    outline.iter_mut().for_each(|(x, _)| x[0] += 2.0);
    let n = (revolved_area(&outline) * (0.82 * thickness).powi(2)) as usize;
    let name = format!("folded sheet, {n_layers} layers, {thickness}");
    Case::new(name, revolved(&outline, n, &mut Random(seed)), thickness)
}

/// A solid cone, whose side meets its base at 63 degrees.
pub fn cone(n: usize, seed: u64) -> Case {
    Case::new(format!("cone, {n}"), revolved(&half_cone(), n, &mut Random(seed)), f64::INFINITY)
}

/// A pyramid with a square base, which its sides meet at 56 degrees.
pub fn pyramid(n: usize, seed: u64) -> Case {
    let corners = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    let mut triangles: Vec<_> =
        (0..4).map(|side| [corners[side], corners[(side + 1) % 4], [0.0, 0.0, 1.5]]).collect();
    triangles.extend([[corners[0], corners[2], corners[1]], [corners[0], corners[3], corners[2]]]);
    Case::new(format!("pyramid, {n}"), faceted(&triangles, n, &mut Random(seed)), f64::INFINITY)
}

/// The faces of a box of half extents 1, 0.7 and 0.5, two triangles each, its lid first.
pub fn box_faces() -> Vec<[[f64; 3]; 3]> {
    let half = [1.0, 0.7, 0.5];
    let faces = [(2, 1.0), (2, -1.0), (0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)];
    let triangles = faces.map(|(axis, side)| {
        let corner = |u: f64, v: f64| {
            let mut x = [0.0; 3];
            x[axis] = side * half[axis];
            x[(axis + 1) % 3] = u * half[(axis + 1) % 3];
            x[(axis + 2) % 3] = side * v * half[(axis + 2) % 3];
            x
        };
        let [a, b, c, e] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        [[a, b, c], [a, c, e]]
    });
    triangles.concat()
}

/// A round plate with a round rim, `thickness` spacings thick.
pub fn plate(n: usize, thickness: f64, seed: u64) -> Case {
    let spacing = surface_spacing(TAU, n);
    let outline = half_plate(1.0, thickness * spacing);
    Case::new(format!("plate, {thickness}"), revolved(&outline, n, &mut Random(seed)), thickness)
}

/// A lens: two spherical caps that meet in an edge, `thickness` spacings thick in the middle.
pub fn lens(n: usize, thickness: f64, seed: u64) -> Case {
    let spacing = surface_spacing(TAU, n);
    let outline = half_lens(1.0, thickness * spacing);
    Case::new(format!("lens, {thickness}"), revolved(&outline, n, &mut Random(seed)), thickness)
}

/// A thin torus whose tube has a radius of `radius` spacings.
pub fn tube(n: usize, radius: f64, seed: u64) -> Case {
    // h = 0.82 √(4π² R r / n), and r is `radius` times h, for R = 1.
    let tube = (radius * 0.82 * TAU).powi(2) / n as f64;
    let sided = revolved(&ring(1.0, tube), n, &mut Random(seed));
    Case::new(format!("tube, {radius}"), sided, 2.0 * radius)
}

/// Two unit spheres, `gap` spacings apart. They touch if `gap` is 0.
pub fn two_spheres(n: usize, gap: f64, seed: u64) -> Case {
    let mut random = Random(seed);
    let spacing = surface_spacing(2.0 * TAU, n / 2);
    let parts = [0.0, 2.0 + gap * spacing].map(|x| sphere([x, 0.0, 0.0], 1.0, n / 2, &mut random));
    Case::new(format!("two spheres, {gap}"), OrientedCloud::together(&parts), gap)
}

/// A hollow ball: a unit sphere around a sphere of radius `share`, whose normals point into the cavity.
pub fn nested_spheres(n: usize, share: f64, seed: u64) -> Case {
    let mut random = Random(seed);
    let n_inner = (n as f64 * share * share / (1.0 + share * share)) as usize;
    let parts = [
        sphere([0.0; 3], 1.0, n - n_inner, &mut random),
        sphere([0.0; 3], share, n_inner, &mut random).inside_out(),
    ];
    let gap = (1.0 - share) / surface_spacing(2.0 * TAU, n - n_inner);
    Case::new(format!("nested spheres, {share}"), OrientedCloud::together(&parts), gap)
}
