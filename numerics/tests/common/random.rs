//! Random numbers that are the same on every machine.

#![allow(dead_code, reason = "each test takes what it needs")]

use std::f64::consts::TAU;

/// A SplitMix64 generator (Steele, Lea and Flood 2014). The field is the seed, then the state.
pub struct Random(pub u64);

impl Random {
    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [0, 2π).
    pub fn angle(&mut self) -> f64 {
        TAU * self.uniform()
    }

    /// Standard normal (Box and Muller 1958).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * self.angle().cos()
    }

    /// A point of the unit sphere, uniform in area. Its height is therefore uniform in [−1, 1] (Archimedes).
    pub fn on_sphere(&mut self) -> [f64; 3] {
        let (z, angle) = (2.0 * self.uniform() - 1.0, self.angle());
        let r = (1.0 - z * z).sqrt();
        [r * angle.cos(), r * angle.sin(), z]
    }
}
