//! The paper's samples (errata.md, "Settled by reproducing the tables"), with those that other tests share.

use std::f64::consts::TAU;

use super::common::clouds::{TORUS, cloud, torus_point};
use super::random::Random;
use super::support::Cloud;

/// n random points of the unit sphere.
pub fn directions(n: usize, seed: u64) -> Cloud {
    let mut random = Random::of_seed(seed);
    cloud(&(0..n).map(|_| random.direction()).collect::<Vec<_>>())
}

/// Fibonacci points on the torus: `u_i = 2π frac(i(√5−1)/2)`, v_i from `(R₁v + R₂ sin v)/(2πR₁) = (i+½)/m`.
pub fn fibonacci_torus(m: usize) -> Cloud {
    let point = |i: usize| {
        let u = TAU * (i as f64 * (5f64.sqrt() - 1.0) / 2.0).fract();
        torus_point(u, angle_of_area((i as f64 + 0.5) / m as f64))
    };
    cloud(&(0..m).map(point).collect::<Vec<_>>())
}

/// The v below which a fraction of the torus' area lies, by Newton's method. The
/// slope is at least R₁ − R₂ > 0.
fn angle_of_area(fraction: f64) -> f64 {
    let [r1, r2] = TORUS;
    (0..50).fold(TAU * fraction, |v: f64, _| {
        v - (r1 * v + r2 * v.sin() - TAU * r1 * fraction) / (r1 + r2 * v.cos())
    })
}
