//! Clouds on which the signature function is known to struggle.

use std::f64::consts::PI;

use super::common::clouds::{closed_curve_point, random_cube, rows, square_grid};
use super::common::random::Random;

/// A cloud with its outward unit normals.
pub struct OrientedCloud {
    pub points: Vec<f64>,
    pub normals: Vec<Vec<f64>>,
    pub dimension: usize,
}

impl OrientedCloud {
    fn new<const D: usize>(pairs: impl Iterator<Item = ([f64; D], [f64; D])>) -> Self {
        let (mut points, mut normals) = (Vec::new(), Vec::new());
        for (x, normal) in pairs {
            points.extend(x);
            let length = normal.iter().map(|c| c * c).sum::<f64>().sqrt();
            normals.push(normal.iter().map(|c| c / length).collect());
        }
        Self { points, normals, dimension: D }
    }
}

/// The paper's closed curve at equidistant parameters.
pub fn closed_curve(n: usize) -> OrientedCloud {
    OrientedCloud::new((0..n).map(|i| closed_curve_point(2.0 * PI * i as f64 / n as f64)))
}

/// Two balls joined by a neck: the surface of revolution of `r(z)² = 4(1 − z²)(z² + 0.1)` about z.
pub fn dumbbell(n: usize) -> OrientedCloud {
    let square = |z: f64| 4.0 * (1.0 - z * z) * (z * z + 0.1);
    let slope = |z: f64| 8.0 * z * (0.9 - 2.0 * z * z);
    // Area per dz is 2π √(r² + (r r′)²). Each point gets an equal share of it.
    let cells = 20_000;
    let middle = |i: usize| -1.0 + 2.0 * (i as f64 + 0.5) / cells as f64;
    let area = |z: f64| (square(z) + 0.25 * slope(z).powi(2)).sqrt();
    let total: f64 = (0..cells).map(|i| area(middle(i))).sum();
    let (mut below, mut heights) = (0.0, Vec::with_capacity(n));
    for i in 0..cells {
        below += area(middle(i));
        while heights.len() < n && below * n as f64 >= (heights.len() as f64 + 0.5) * total {
            heights.push(middle(i));
        }
    }
    OrientedCloud::new(heights.into_iter().enumerate().map(|(i, z)| {
        let angle = PI * (1.0 + 5f64.sqrt()) * i as f64;
        let (s, c) = angle.sin_cos();
        let r = square(z).sqrt();
        ([r * c, r * s, z], [2.0 * r * c, 2.0 * r * s, -slope(z)])
    }))
}

/// Points of a graph over [−1, 1]², on a grid of side² points, with upward normals.
pub fn graph(side: usize, height: impl Fn(f64, f64) -> f64) -> OrientedCloud {
    let step = 1e-5;
    OrientedCloud::new(rows::<2>(&square_grid(side)).into_iter().map(|[x, y]| {
        let slope_x = (height(x + step, y) - height(x - step, y)) / (2.0 * step);
        let slope_y = (height(x, y + step) - height(x, y - step)) / (2.0 * step);
        ([x, y, height(x, y)], [-slope_x, -slope_y, 1.0])
    }))
}

/// The side of a cylinder of radius ½ and height 3, open at both ends, on a staggered grid.
pub fn cylinder(around: usize, along: usize) -> OrientedCloud {
    OrientedCloud::new((0..around * along).map(|i| {
        let row = i / around;
        let turn = (i % around) as f64 + if row.is_multiple_of(2) { 0.0 } else { 0.5 };
        let (s, c) = (2.0 * PI * turn / around as f64).sin_cos();
        ([0.5 * c, 0.5 * s, 3.0 * row as f64 / (along - 1) as f64], [c, s, 0.0])
    }))
}

/// The upper half of the unit sphere, n points of a Fibonacci lattice.
pub fn half_sphere(n: usize) -> OrientedCloud {
    OrientedCloud::new((0..n).map(|i| {
        let z = 1.0 - (i as f64 + 0.5) / n as f64;
        let (s, c) = (PI * (1.0 + 5f64.sqrt()) * i as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        ([r * c, r * s, z], [r * c, r * s, z])
    }))
}

/// A plate `[−1, 1]² × [0, thickness]` without its rim: two grids of side² points, normals pointing apart.
pub fn plate(side: usize, thickness: f64) -> OrientedCloud {
    let square = rows::<2>(&square_grid(side));
    let layer = |z: f64, normal: f64| square.iter().map(move |&[x, y]| ([x, y, z], [0.0, 0.0, normal]));
    OrientedCloud::new(layer(0.0, -1.0).chain(layer(thickness, 1.0)))
}

/// A flat square in general position with its unit normal: a grid, or as many random points.
pub fn flat_square(side: usize, random: Option<&mut Random>) -> OrientedCloud {
    let (u, v) = ([0.36, 0.48, -0.8], [-0.8, 0.6, 0.0]);
    let normal = [0.48, 0.64, 0.6];
    let square = match random {
        None => square_grid(side),
        Some(random) => random_cube(side * side, 2, random),
    };
    let point = |[a, b]: [f64; 2]| [0, 1, 2].map(|c| a * u[c] + b * v[c] + 0.3);
    OrientedCloud::new(rows(&square).into_iter().map(|x| (point(x), normal)))
}
