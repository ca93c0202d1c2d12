//! The paper's samples (errata.md, "Settled by reproducing the tables").

use std::f64::consts::{PI, TAU};

use super::random::Random;

/// Fibonacci points on the unit sphere: z_i = 1 − (2i+1)/m, angle π(1+√5)i.
pub fn sphere(m: usize) -> Vec<[f64; 3]> {
    let point = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / m as f64;
        let (r, angle) = ((1.0 - z * z).sqrt(), PI * (1.0 + 5f64.sqrt()) * i as f64);
        [r * angle.cos(), r * angle.sin(), z]
    };
    (0..m).map(point).collect()
}

/// Radii of the ring torus.
pub const TORUS: [f64; 2] = [2.0, 0.5];

/// The point of the torus at two angles, v = 0 on the outside.
pub fn torus_point(u: f64, v: f64) -> [f64; 3] {
    let [r1, r2] = TORUS;
    let r = r1 + r2 * v.cos();
    // The paper prints R₂ sin(u) (errata.md, 5).
    [r * u.cos(), r * u.sin(), r2 * v.sin()]
}

/// Fibonacci points on the torus: `u_i = 2π frac(i(√5−1)/2)`, v_i from `(R₁v + R₂ sin v)/(2πR₁) = (i+½)/m`.
pub fn fibonacci_torus(m: usize) -> Vec<[f64; 3]> {
    let point = |i: usize| {
        let u = TAU * (i as f64 * (5f64.sqrt() - 1.0) / 2.0).fract();
        torus_point(u, angle_of_area((i as f64 + 0.5) / m as f64))
    };
    (0..m).map(point).collect()
}

/// The v below which a fraction of the torus' area lies, by Newton's method: the slope is at least R₁ − R₂ > 0.
fn angle_of_area(fraction: f64) -> f64 {
    let [r1, r2] = TORUS;
    (0..50).fold(TAU * fraction, |v: f64, _| {
        v - (r1 * v + r2 * v.sin() - TAU * r1 * fraction) / (r1 + r2 * v.cos())
    })
}

/// Uniform on the torus: angles accepted with probability `(R₁ + R₂ cos v)/(R₁ + R₂)` (Foley et al. 1996).
pub fn random_torus(m: usize, random: &mut Random) -> Vec<[f64; 3]> {
    let [r1, r2] = TORUS;
    let mut points = Vec::with_capacity(m);
    while points.len() < m {
        let (u, v) = (random.angle(), random.angle());
        if random.uniform() < (r1 + r2 * v.cos()) / (r1 + r2) {
            points.push(torus_point(u, v));
        }
    }
    points
}

/// Scales the axes.
pub fn stretched(points: &[[f64; 3]], axes: [f64; 3]) -> Vec<[f64; 3]> {
    points.iter().map(|x| [0, 1, 2].map(|c| axes[c] * x[c])).collect()
}
