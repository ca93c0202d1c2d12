//! Closed surfaces f = 0 of radius about 1, with edges, necks, thin parts and bumps.

use crate::common::random::Random;

type Point = [f64; 3];

/// A closed surface f = 0: its name, f, which grows outward, and the half sides of a box that holds it.
pub type ClosedSurface = (&'static str, fn(Point) -> f64, Point);

pub const CLOSED_SURFACES: [ClosedSurface; 22] = [
    ("sphere", |x| norm(x) - 1.0, [1.1; 3]),
    ("torus", |x| torus(x, 0.7, 0.3), [1.1, 1.1, 0.4]),
    ("thin torus", |x| torus(x, 0.85, 0.12), [1.1, 1.1, 0.2]),
    ("ellipsoid", |[x, y, z]| norm([x, y / 0.7, z / 0.5]) - 1.0, [1.1, 0.8, 0.6]),
    ("disk", |[x, y, z]| norm([x, y, z / 0.25]) - 1.0, [1.1, 1.1, 0.3]),
    ("needle", |[x, y, z]| norm([x, y / 0.2, z / 0.2]) - 1.0, [1.1, 0.3, 0.3]),
    ("rounded cube", |x| power_norm(x, 6.0) - 0.8, [0.9; 3]),
    ("octahedron", |x| power_norm(x, 1.4) - 1.0, [1.1; 3]),
    ("brick", |[x, y, z]| power_norm([x, y / 0.6, z / 0.3], 8.0) - 0.9, [1.0, 0.7, 0.4]),
    ("can", |[x, y, z]| power_norm([x.hypot(y) / 0.6, z, 0.0], 8.0) - 0.8, [0.6, 0.6, 0.9]),
    ("capsule", |[x, y, z]| norm([x - x.clamp(-0.6, 0.6), y, z]) - 0.35, [1.1, 0.5, 0.5]),
    (
        "cone",
        |[x, y, z]| power_norm([(x.hypot(y) / (0.9 - 0.7 * z)) * 1.2, z, 0.0], 6.0) - 0.8,
        [1.1, 1.1, 0.9],
    ),
    ("dumbbell", |[x, y, z]| y.hypot(z) - neck(x), [1.0, 0.6, 0.6]),
    ("peanut", |x| cassini(x, 0.62, 0.68), [1.1, 0.6, 0.6]),
    ("bowl", |x| smooth_max(norm(x) - 1.0, 0.85 - norm([x[0], x[1], x[2] - 0.5]), 0.05), [1.1; 3]),
    ("bumps", |x| norm(x) - 0.85 - 0.12 * (5.0 * x[0]).sin() * (5.0 * x[1]).sin(), [1.1; 3]),
    ("star", |x| norm(x) - 0.8 - 0.25 * star(x), [1.2; 3]),
    ("tooth", |[x, y, z]| quartic([x, y, z]) - 0.6 * (x * x + y * y + z * z), [1.1; 3]),
    ("two holes", two_holes, [1.3, 0.8, 0.4]),
    (
        "wavy plate",
        |[x, y, z]| power_norm([x, y, (z - 0.15 * (4.0 * x).sin()) / 0.25], 6.0) - 0.9,
        [1.0, 1.0, 0.5],
    ),
    ("banana", |[x, y, z]| norm([x, (y - 0.6 * x * x) / 0.4, z / 0.4]) - 1.0, [1.1, 1.1, 0.5]),
    ("bells", |x| 0.5 - bells(x), [1.0; 3]),
];

/// n points of a surface, by Newton's method from random starts near it.
pub fn sample(f: fn(Point) -> f64, half_sides: Point, n: usize, random: &mut Random) -> Vec<Point> {
    let mut points = Vec::with_capacity(n);
    while points.len() < n {
        let start = half_sides.map(|half| (2.0 * random.uniform() - 1.0) * half);
        let mut x = start;
        for _ in 0..12 {
            let (value, g) = (f(x), gradient(f, x));
            let square: f64 = g.iter().map(|g| g * g).sum();
            (0..3).for_each(|c| x[c] -= value / square * g[c]);
        }
        let moved = norm([x[0] - start[0], x[1] - start[1], x[2] - start[2]]);
        // NaN where f has no gradient fails both comparisons.
        if f(x).abs() < 1e-10 && moved < 0.04 {
            points.push(x);
        }
    }
    points
}

/// The outward unit normal, accurate to 1e-8.
pub fn outward_normal(f: fn(Point) -> f64, x: Point) -> Point {
    let g = gradient(f, x);
    let length = norm(g);
    g.map(|c| c / length)
}

fn gradient(f: fn(Point) -> f64, x: Point) -> Point {
    const STEP: f64 = 1e-6;
    std::array::from_fn(|c| {
        let at = |step: f64| {
            let mut moved = x;
            moved[c] += step;
            f(moved)
        };
        (at(STEP) - at(-STEP)) / (2.0 * STEP)
    })
}

fn norm(x: Point) -> f64 {
    power_norm(x, 2.0)
}

fn power_norm(x: Point, p: f64) -> f64 {
    x.iter().map(|c| c.abs().powf(p)).sum::<f64>().powf(1.0 / p)
}

fn quartic(x: Point) -> f64 {
    x.iter().map(|c| c.powi(4)).sum()
}

fn torus([x, y, z]: Point, radius: f64, tube: f64) -> f64 {
    (x.hypot(y) - radius).hypot(z) - tube
}

/// Radius at x of a body of revolution about the x axis.
fn neck(x: f64) -> f64 {
    (1.0 - x * x).max(0.0).sqrt() * (0.12 + 0.5 * x * x)
}

/// Ovals of Cassini about the x axis.
fn cassini([x, y, z]: Point, a: f64, b: f64) -> f64 {
    norm([x - a, y, z]) * norm([x + a, y, z]) - b * b
}

fn smooth_max(a: f64, b: f64, width: f64) -> f64 {
    width * ((a / width).exp() + (b / width).exp()).ln()
}

fn star(x: Point) -> f64 {
    let [x, y, z] = x.map(|c| c / norm(x).max(1e-9));
    5.0 * x * y * z + 0.4 * (x * x - y * y)
}

fn two_holes([x, y, z]: Point) -> f64 {
    let plane = x * x * (1.0 - 0.8 * x * x) - y * y;
    4.0 * plane * plane + z * z - 0.03
}

fn bells(x: Point) -> f64 {
    const CENTRES: [Point; 4] = [[0.45, 0.0, 0.0], [-0.3, 0.35, 0.1], [-0.2, -0.4, -0.1], [0.1, 0.1, 0.45]];
    let bell = |c: Point| (-norm([x[0] - c[0], x[1] - c[1], x[2] - c[2]]).powi(2) / 0.12).exp();
    CENTRES.into_iter().map(bell).sum()
}
