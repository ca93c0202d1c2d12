//! Seeded random numbers, so that every run draws the same clouds.

pub use super::common::random::Random;

impl Random {
    /// A generator whose state is far from those of neighbouring seeds.
    pub fn of_seed(seed: u64) -> Self {
        Self(seed.wrapping_mul(0xd134_2543_de82_ef95))
    }

    /// A direction uniform on the unit sphere of R³: a normal vector, normalised, as in the paper.
    pub fn direction(&mut self) -> [f64; 3] {
        let v = [self.normal(), self.normal(), self.normal()];
        let norm = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        v.map(|x| x / norm)
    }
}
