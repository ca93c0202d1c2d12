//! Random numbers that depend on the seed alone, not on the machine or the number of threads.

use std::f64::consts::TAU;

/// The random number generator SplitMix64 (Steele, Lea and Flood 2014).
pub(crate) struct Random(u64);

const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

impl Random {
    /// Starts the stream number `stream` of a seed.
    pub(crate) fn of(seed: u64, stream: u64) -> Self {
        Self(mixed(seed.wrapping_add(STEP)) ^ mixed(stream.wrapping_mul(STEP)))
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(STEP);
        mixed(self.0)
    }

    /// Returns an index below n, uniform up to 2⁻⁵³.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        ((self.uniform() * n as f64) as usize).min(n.saturating_sub(1))
    }

    /// Returns a number uniform in [0, 1), a multiple of 2⁻⁵³.
    pub(crate) fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Fills a slice with standard normal numbers (Box and Muller 1958).
    pub(crate) fn fill_normal(&mut self, numbers: &mut [f64]) {
        for pair in numbers.chunks_mut(2) {
            let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
            let (sine, cosine) = (TAU * self.uniform()).sin_cos();
            pair[0] = radius * cosine;
            if let Some(other) = pair.get_mut(1) {
                *other = radius * sine;
            }
        }
    }
}

/// Mixes all bits of a number, one to one: the finalizer of SplitMix64.
pub(crate) fn mixed(x: u64) -> u64 {
    let z = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_those_of_the_normal_distribution_and_streams_have_nothing_in_common() {
        let draw = |seed, stream| {
            let mut numbers = vec![0.0; 100_001];
            Random::of(seed, stream).fill_normal(&mut numbers);
            numbers
        };
        let (a, b) = (draw(7, 0), draw(7, 1));
        assert_eq!(a, draw(7, 0));
        let n = a.len() as f64;
        let mean = |of: &dyn Fn(usize) -> f64| (0..a.len()).map(of).sum::<f64>() / n;
        // The bounds are four standard errors: 1/√n of a mean, √(2/n) and √(96/n) of the second and fourth
        // moment.
        assert!(mean(&|i| a[i]).abs() < 4.0 / n.sqrt());
        assert!((mean(&|i| a[i] * a[i]) - 1.0).abs() < 4.0 * (2.0 / n).sqrt());
        assert!((mean(&|i| a[i].powi(4)) - 3.0).abs() < 4.0 * (96.0 / n).sqrt());
        assert!(mean(&|i| a[i] * b[i]).abs() < 4.0 / n.sqrt());
    }
}
