//! Seeded random numbers, so that every run draws the same clouds.

use std::f64::consts::TAU;

pub use super::uniform::Random;

impl Random {
    /// Far apart for neighbouring seeds.
    pub fn of_seed(seed: u64) -> Self {
        Self(seed.wrapping_mul(0xd134_2543_de82_ef95))
    }

    /// In [0, 2π).
    pub fn angle(&mut self) -> f64 {
        TAU * self.uniform()
    }

    /// Standard normal, by Box and Muller (1958).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * self.angle().cos()
    }

    /// Uniform on the unit sphere of R³: a normal vector, normalised, as in the paper.
    pub fn direction(&mut self) -> [f64; 3] {
        let v = [self.normal(), self.normal(), self.normal()];
        let norm = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        v.map(|x| x / norm)
    }
}
