//! Clouds, and values at their points, shared by tests, benchmarks and examples.
//!
//! The unit tests inside the library include this file too (src/testing.rs). It therefore uses only `Cloud`,
//! by its public path, and the random numbers beside it.

#![allow(dead_code, reason = "each test takes what it needs")]

use std::f64::consts::PI;

use gramian_numerics::points::cloud::Cloud;

use super::random::Random;

/// Makes a cloud of points.
pub fn cloud<const D: usize>(points: &[[f64; D]]) -> Cloud {
    Cloud::new(points.concat(), D).unwrap()
}

/// The points of a cloud of dimension D, to be changed one by one.
pub fn rows<const D: usize>(cloud: &Cloud) -> Vec<[f64; D]> {
    cloud.points().map(|x| <[f64; D]>::try_from(x).unwrap()).collect()
}

/// A Fibonacci lattice of n points on the unit sphere: z_i = 1 − (2i+1)/n, angle
/// π(1+√5)i (errata.md, "Settled").
pub fn fibonacci_sphere(n: usize) -> Cloud {
    turned_fibonacci_sphere(n, 0.0)
}

/// A Fibonacci lattice on the unit sphere, turned about z by an angle. The points of two such clouds differ.
pub fn turned_fibonacci_sphere(n: usize, angle: f64) -> Cloud {
    let golden = PI * (1.0 + 5f64.sqrt());
    let point = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / n as f64;
        let (r, t) = ((1.0 - z * z).sqrt(), golden * i as f64 + angle);
        [r * t.cos(), r * t.sin(), z]
    };
    Cloud::new((0..n).flat_map(point).collect(), 3).unwrap()
}

/// n points on the unit sphere, uniform in area.
pub fn random_sphere(n: usize, random: &mut Random) -> Cloud {
    Cloud::new((0..n).flat_map(|_| random.on_sphere()).collect(), 3).unwrap()
}

/// n equidistant points on the unit circle.
pub fn circle(n: usize) -> Cloud {
    turned_circle(n, 0.0)
}

/// n equidistant points on the unit circle, turned by a number of steps from one point to the next.
pub fn turned_circle(n: usize, steps: f64) -> Cloud {
    let point = |i: usize| {
        let t = 2.0 * PI * (i as f64 + steps) / n as f64;
        [t.cos(), t.sin()]
    };
    Cloud::new((0..n).flat_map(point).collect(), 2).unwrap()
}

/// Radii of the ring torus of the paper: R₁ of the ring, R₂ of the tube.
pub const TORUS: [f64; 2] = [2.0, 0.5];

/// The point of the torus [`TORUS`] at two angles, v = 0 on the outside.
pub fn torus_point(u: f64, v: f64) -> [f64; 3] {
    let [r1, r2] = TORUS;
    let r = r1 + r2 * v.cos();
    // The paper prints R₂ sin(u) (errata.md, 5).
    [r * u.cos(), r * u.sin(), r2 * v.sin()]
}

/// n points on the torus [`TORUS`], uniform in area: angles are accepted with probability
/// `(R₁ + R₂ cos v)/(R₁ + R₂)` (Foley et al. 1996).
pub fn random_torus(n: usize, random: &mut Random) -> Cloud {
    let [r1, r2] = TORUS;
    let mut points = Vec::with_capacity(n);
    while points.len() < n {
        let (u, v) = (random.angle(), random.angle());
        if random.uniform() < (r1 + r2 * v.cos()) / (r1 + r2) {
            points.push(torus_point(u, v));
        }
    }
    cloud(&points)
}

/// n points in the cube [−1, 1]^d, uniform in volume.
pub fn random_cube(n: usize, d: usize, random: &mut Random) -> Cloud {
    Cloud::new((0..n * d).map(|_| 2.0 * random.uniform() - 1.0).collect(), d).unwrap()
}

/// side² points of the square [−1, 1]², boundary included, ordered by rows of equal y.
pub fn square_grid(side: usize) -> Cloud {
    let at = |i: usize| 2.0 * i as f64 / (side - 1) as f64 - 1.0;
    Cloud::new((0..side * side).flat_map(|i| [at(i % side), at(i / side)]).collect(), 2).unwrap()
}

/// A point of the paper's closed curve `(sin t, sin³t + ½ cos t)`, and the outward direction there, not of
/// length 1. The curve has four inflections. It runs clockwise, so outward is left of the tangent.
pub fn closed_curve_point(t: f64) -> ([f64; 2], [f64; 2]) {
    let (sin, cos) = t.sin_cos();
    ([sin, sin.powi(3) + 0.5 * cos], [-(3.0 * sin * sin * cos - 0.5 * sin), cos])
}

/// Multiplies the coordinates of every point by one factor per axis.
pub fn stretched(cloud: &Cloud, factors: &[f64]) -> Cloud {
    let stretch = |(x, f): (&f64, &f64)| x * f;
    let coordinates = cloud.coordinates().iter().zip(factors.iter().cycle()).map(stretch).collect();
    Cloud::new(coordinates, cloud.dimension()).unwrap()
}

/// Moves every coordinate by a normal number of this standard deviation.
pub fn noisy(cloud: &Cloud, deviation: f64, random: &mut Random) -> Cloud {
    let coordinates = cloud.coordinates().iter().map(|x| x + deviation * random.normal()).collect();
    Cloud::new(coordinates, cloud.dimension()).unwrap()
}

/// A smooth function of size 1, different in every coordinate.
pub fn wave(x: &[f64]) -> f64 {
    (0.3 + x.iter().enumerate().map(|(c, x)| (1.0 + 0.4 * c as f64) * x).sum::<f64>()).sin()
}

/// Values of [`wave`] at the points.
pub fn waves(cloud: &Cloud) -> Vec<f64> {
    cloud.points().map(wave).collect()
}
