//! Closed curves and surfaces with outward normals, some of them thin or close to one another.

use std::f64::consts::{PI, TAU};

use gramian_numerics::points::cloud::Cloud;

use crate::common::random::Random;

/// A point of a curve with its outward unit normal.
pub type Place = ([f64; 2], [f64; 2]);

/// A cloud with its outward unit normals, `[n, d]`.
pub struct OrientedCloud {
    pub cloud: Cloud,
    pub normals: Vec<f64>,
}

impl OrientedCloud {
    fn of<const D: usize>(places: impl IntoIterator<Item = ([f64; D], [f64; D])>) -> Self {
        let (points, normals): (Vec<_>, Vec<_>) = places.into_iter().unzip();
        Self { cloud: Cloud::new(points.concat(), D).unwrap(), normals: normals.concat() }
    }

    /// Joins the points of several clouds into one.
    pub fn together(parts: &[Self]) -> Self {
        let points = parts.iter().flat_map(|part| part.cloud.coordinates().iter().copied()).collect();
        let normals = parts.iter().flat_map(|part| part.normals.iter().copied()).collect();
        Self { cloud: Cloud::new(points, parts[0].cloud.dimension()).unwrap(), normals }
    }

    /// Moves the points by normal noise of a deviation `sigma` in every direction, and keeps their normals.
    pub fn noisy(mut self, sigma: f64, random: &mut Random) -> Self {
        let moved = self.cloud.coordinates().iter().map(|x| x + sigma * random.normal()).collect();
        self.cloud = Cloud::new(moved, self.cloud.dimension()).unwrap();
        self
    }

    /// Reverses the normals, as for a cavity.
    pub fn inside_out(mut self) -> Self {
        self.normals.iter_mut().for_each(|c| *c = -*c);
        self
    }
}

/// n points of the closed curve `r(t) (cos t, sin t)`, at random t or at equal steps.
pub fn polar(r: impl Fn(f64) -> f64, n: usize, random: Option<&mut Random>) -> OrientedCloud {
    let angles: Vec<f64> = match random {
        Some(random) => (0..n).map(|_| random.angle()).collect(),
        None => (0..n).map(|i| TAU * i as f64 / n as f64).collect(),
    };
    const STEP: f64 = 1e-5;
    OrientedCloud::of(angles.into_iter().map(|t| {
        let (s, c) = t.sin_cos();
        let (radius, slope) = (r(t), (r(t + STEP) - r(t - STEP)) / (2.0 * STEP));
        let length = radius.hypot(slope);
        let normal = [radius * c + slope * s, radius * s - slope * c].map(|x| x / length);
        ([radius * c, radius * s], normal)
    }))
}

/// The oval of Cassini `|x − (a, 0)| |x + (a, 0)| = b²`, a < b, as radius over angle.
pub fn cassini(a: f64, b: f64) -> impl Fn(f64) -> f64 {
    move |t: f64| {
        let root = (b.powi(4) - (a * a * (2.0 * t).sin()).powi(2)).sqrt();
        (a * a * (2.0 * t).cos() + root).sqrt()
    }
}

/// The outline of a folded strip: `n_layers` straight parts of a length one above the other, `gap` apart.
///
/// The strip has a thickness and round ends. It starts at the axis x = 0 and lies to the right of it.
pub fn folded_strip(thickness: f64, gap: f64, n_layers: usize, length: f64) -> Vec<Place> {
    let fine = 0.02 * thickness.min(gap);
    let radius = 0.5 * (thickness + gap);
    // The middle line: points, and the direction to the left of the walk.
    let mut middle: Vec<Place> = Vec::new();
    for layer in 0..n_layers {
        let y = 2.0 * radius * layer as f64;
        let forth = if layer.is_multiple_of(2) { 1.0 } else { -1.0 };
        let n_steps = (length / fine).ceil() as usize;
        let along = (0..=n_steps).map(|i| length * (forth * (i as f64 / n_steps as f64 - 0.5) + 0.5));
        middle.extend(along.map(|x| ([x, y], [0.0, forth])));
        if layer + 1 < n_layers {
            let n_steps = (PI * radius / fine).ceil() as usize;
            let end = if forth > 0.0 { length } else { 0.0 };
            middle.extend((1..n_steps).map(|i| {
                let (s, c) = (PI * i as f64 / n_steps as f64).sin_cos();
                ([end + forth * radius * s, y + radius * (1.0 - c)], [-forth * s * forth, c * forth])
            }));
        }
    }
    // On the arcs the left of a walk to the right faces the centre.
    let offset = |(x, left): Place, side: f64| {
        let normal = left.map(|c| side * c);
        ([x[0] + 0.5 * thickness * normal[0], x[1] + 0.5 * thickness * normal[1]], normal)
    };
    let cap = |(x, left): Place, turn: f64| {
        (1..60).map(move |i| {
            let (s, c) = (PI * f64::from(i) / 60.0).sin_cos();
            // From the left side over the end to the right side.
            let ahead = [left[1] * turn, -left[0] * turn];
            let normal = [c * left[0] + s * ahead[0], c * left[1] + s * ahead[1]];
            ([x[0] + 0.5 * thickness * normal[0], x[1] + 0.5 * thickness * normal[1]], normal)
        })
    };
    let (first, last) = (middle[0], middle[middle.len() - 1]);
    let forth = middle.iter().map(|&place| offset(place, 1.0));
    let back = middle.iter().rev().map(|&place| offset(place, -1.0));
    let mut outline: Vec<Place> = forth.chain(cap(last, 1.0)).chain(back).collect();
    let end: Vec<Place> = cap(first, -1.0).collect();
    outline.extend(end.into_iter().rev());
    outline
}

/// Half of the outline of a round plate with a round rim, from the axis x = 0 to the right.
pub fn half_plate(radius: f64, thickness: f64) -> Vec<Place> {
    let (inner, half) = (radius - 0.5 * thickness, 0.5 * thickness);
    let across = |i: i32| inner * f64::from(i) / 4000.0;
    let below = (0..4000).map(|i| ([across(i), -half], [0.0, -1.0]));
    let rim = (0..=400).map(|i| {
        let (s, c) = (PI * (f64::from(i) / 400.0 - 0.5)).sin_cos();
        ([inner + half * c, half * s], [c, s])
    });
    let above = (0..4000).rev().map(|i| ([across(i), half], [0.0, 1.0]));
    below.chain(rim).chain(above).collect()
}

/// Half of the section of a lens with a radius and a thickness in the middle, whose caps are
/// spheres, from the axis on.
pub fn half_lens(radius: f64, thickness: f64) -> Vec<Place> {
    let half = 0.5 * thickness;
    let of_cap = (radius * radius + half * half) / (2.0 * half);
    let widest = (radius / of_cap).asin();
    let cap = |i: i32, up: f64| {
        let (s, c) = (widest * f64::from(i) / 4000.0).sin_cos();
        ([of_cap * s, up * (half - of_cap * (1.0 - c))], [s, up * c])
    };
    (0..=4000).map(|i| cap(i, -1.0)).chain((0..=4000).rev().map(|i| cap(i, 1.0))).collect()
}

/// Half of the section of a solid cone of radius 1 and height 2, from the middle of its base to its tip.
pub fn half_cone() -> Vec<Place> {
    let slope = 5f64.sqrt();
    let side = [2.0 / slope, 1.0 / slope];
    let base = [0.0, -1.0];
    vec![([0.0, 0.0], base), ([1.0, 0.0], base), ([1.0, 0.0], side), ([0.0, 2.0], side)]
}

/// n random points, uniform in area, of flat triangles whose corners turn to the left as seen from outside.
pub fn faceted(triangles: &[[[f64; 3]; 3]], n: usize, random: &mut Random) -> OrientedCloud {
    let arm = |a: [f64; 3], b: [f64; 3]| [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
    let normal = |&[a, b, c]: &[[f64; 3]; 3]| {
        let (u, v) = (arm(a, b), arm(a, c));
        [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    };
    let length = |x: [f64; 3]| x.iter().map(|c| c * c).sum::<f64>().sqrt();
    let most = triangles.iter().map(|of| length(normal(of))).fold(0.0, f64::max);
    let mut places = Vec::with_capacity(n);
    while places.len() < n {
        let of = &triangles[(random.uniform() * triangles.len() as f64) as usize];
        let (normal, [mut s, mut t]) = (normal(of), [random.uniform(), random.uniform()]);
        if random.uniform() * most > length(normal) {
            continue;
        }
        if s + t > 1.0 {
            (s, t) = (1.0 - s, 1.0 - t);
        }
        let at = |c: usize| of[0][c] + s * (of[1][c] - of[0][c]) + t * (of[2][c] - of[0][c]);
        places.push(([at(0), at(1), at(2)], normal.map(|c| c / length(normal))));
    }
    OrientedCloud::of(places)
}

/// A circle with a radius about (at, 0).
pub fn ring(at: f64, radius: f64) -> Vec<Place> {
    let place = |i: i32| {
        let (s, c) = (TAU * f64::from(i) / 4000.0).sin_cos();
        ([at + radius * c, radius * s], [c, s])
    };
    (0..=4000).map(place).collect()
}

/// Random points of an outline, uniform in length.
pub fn along(outline: &[Place], n: usize, random: &mut Random) -> OrientedCloud {
    let lot = Lot::of(outline, |_| 1.0);
    OrientedCloud::of((0..n).map(|_| lot.draw(random)))
}

/// Random points, uniform in area, of the surface that an outline sweeps when turned about x = 0.
pub fn revolved(outline: &[Place], n: usize, random: &mut Random) -> OrientedCloud {
    let lot = Lot::of(outline, |x| x[0]);
    OrientedCloud::of((0..n).map(|_| {
        let ((x, normal), (s, c)) = (lot.draw(random), random.angle().sin_cos());
        ([x[0] * c, x[0] * s, x[1]], [normal[0] * c, normal[0] * s, normal[1]])
    }))
}

/// The area of the surface that an outline sweeps when turned about x = 0.
pub fn revolved_area(outline: &[Place]) -> f64 {
    TAU * Lot::of(outline, |x| x[0]).total()
}

/// The length of an outline.
pub fn length_of(outline: &[Place]) -> f64 {
    Lot::of(outline, |_| 1.0).total()
}

/// The length of the polygon through the points of a plane curve around the origin, by their angles.
pub fn length_around(curve: &Cloud) -> f64 {
    let mut points: Vec<&[f64]> = curve.points().collect();
    points.sort_by(|a, b| a[1].atan2(a[0]).total_cmp(&b[1].atan2(b[0])));
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).sum()
}

/// n random points of a sphere.
pub fn sphere(centre: [f64; 3], radius: f64, n: usize, random: &mut Random) -> OrientedCloud {
    OrientedCloud::of((0..n).map(|_| {
        let normal = random.on_sphere();
        ([0, 1, 2].map(|c| centre[c] + radius * normal[c]), normal)
    }))
}

/// Mean distance to the four nearest others, for n random points of a surface with this area.
pub fn surface_spacing(area: f64, n: usize) -> f64 {
    0.82 * (area / n as f64).sqrt()
}

/// A sampler of points of an outline, with probability by length times a weight.
struct Lot<'a> {
    outline: &'a [Place],
    sums: Vec<f64>,
}

impl<'a> Lot<'a> {
    fn of(outline: &'a [Place], weight: impl Fn([f64; 2]) -> f64) -> Self {
        let mut sums = vec![0.0];
        for pair in outline.windows(2) {
            let ([x, y], [u, v]) = (pair[0].0, pair[1].0);
            let share = (u - x).hypot(v - y) * 0.5 * (weight([x, y]) + weight([u, v]));
            sums.push(sums[sums.len() - 1] + share);
        }
        Self { outline, sums }
    }

    fn total(&self) -> f64 {
        self.sums[self.sums.len() - 1]
    }

    fn draw(&self, random: &mut Random) -> Place {
        let wanted = random.uniform() * self.total();
        let after = self.sums.partition_point(|&sum| sum <= wanted).clamp(1, self.outline.len() - 1);
        let share = (wanted - self.sums[after - 1]) / (self.sums[after] - self.sums[after - 1]);
        let ((x, n), (y, m)) = (self.outline[after - 1], self.outline[after]);
        let between = |a: [f64; 2], b: [f64; 2]| [0, 1].map(|c| a[c] + share * (b[c] - a[c]));
        let normal = between(n, m);
        let length = normal[0].hypot(normal[1]);
        (between(x, y), normal.map(|c| c / length))
    }
}
