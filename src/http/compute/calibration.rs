//! How long work takes on this machine, from what ran on it.
//!
//! Nominally a request takes [`LEAST_SECONDS`] and [`SECONDS_PER_FLOP`] for each of the flops that were counted for it before it began. What
//! it really took, in proportion to that, is averaged for each class: operation, whether it found what it needs, and decade of flops.
//! Averages are of logarithms, so that twice as long and half as long are as far off, and forget half of what they know with each
//! request: machines change, by who else is on them.

use std::collections::HashMap;

/// 20 Gflop/s.
const SECONDS_PER_FLOP: f64 = 5e-11;

/// What the smallest request takes.
const LEAST_SECONDS: f64 = 2e-4;

/// The weight of the last request in its class, and in the average over all, which stands in for classes of which nothing is known.
const WEIGHT: f64 = 0.5;
const WEIGHT_OF_ALL: f64 = 0.1;

/// The most that a request may be off by: a process that was stopped for an hour says nothing about the next one.
const MOST: f64 = 1e3;

/// A request by what its time depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Work {
    /// The operation by name.
    pub operation: &'static str,
    /// Whether nothing has to be made before it can be answered.
    pub is_cached: bool,
    /// What is computed for it, as counted beforehand.
    pub flops: f64,
}

impl Work {
    fn nominal_seconds(&self) -> f64 {
        LEAST_SECONDS + SECONDS_PER_FLOP * self.flops
    }

    fn decade(&self) -> i32 {
        self.flops.max(1.0).log10().floor() as i32
    }
}

/// Averages of ln(measured / nominal).
#[derive(Default)]
pub(super) struct Calibration {
    classes: HashMap<(&'static str, bool), Vec<(i32, f64)>>,
    of_all: f64,
}

impl Calibration {
    /// Learns from a request that was answered.
    pub(super) fn learn(&mut self, work: Work, seconds: f64) {
        let sample = (seconds / work.nominal_seconds()).clamp(1.0 / MOST, MOST).ln();
        self.of_all += WEIGHT_OF_ALL * (sample - self.of_all);
        let decades = self.classes.entry((work.operation, work.is_cached)).or_default();
        match decades.iter_mut().find(|(decade, _)| *decade == work.decade()) {
            Some((_, average)) => *average += WEIGHT * (sample - *average),
            None => decades.push((work.decade(), sample)),
        }
    }

    /// How long a request will take, once its turn has come.
    pub(super) fn seconds(&self, work: Work) -> f64 {
        let of = |is_cached| self.nearest(work.operation, is_cached, work.decade());
        let known = of(work.is_cached).or_else(|| of(!work.is_cached));
        work.nominal_seconds() * known.unwrap_or(self.of_all).exp()
    }

    /// What is known of the same operation with about as many flops.
    fn nearest(&self, operation: &'static str, is_cached: bool, decade: i32) -> Option<f64> {
        let decades = self.classes.get(&(operation, is_cached))?;
        decades.iter().min_by_key(|(known, _)| (known - decade).abs()).map(|&(_, average)| average)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COLD: Work = Work { operation: "compute_normals", is_cached: false, flops: 1e9 };

    #[test]
    fn what_ran_tells_how_long_the_next_one_takes() {
        let mut calibration = Calibration::default();
        assert!((calibration.seconds(COLD) - 0.0502).abs() < 1e-12);
        // A machine ten times as slow: known at once for the same work, and for what is like it.
        calibration.learn(COLD, 0.502);
        assert!((calibration.seconds(COLD) - 0.502).abs() < 1e-12);
        assert!((calibration.seconds(Work { flops: 1e10, ..COLD }) - 5.002).abs() < 1e-9);
        assert!((calibration.seconds(Work { is_cached: true, ..COLD }) - 0.502).abs() < 1e-12);
        // A tenth of it for what has another name.
        let other = Work { operation: "compute_posterior", ..COLD };
        assert!((calibration.seconds(other) - 0.0502 * 10_f64.powf(0.1)).abs() < 1e-12);
        // Small requests do not speak for large ones.
        let small = Work { flops: 1e4, ..COLD };
        calibration.learn(small, 2e-5);
        assert!((calibration.seconds(COLD) - 0.502).abs() < 1e-12);
        assert!(calibration.seconds(small) < 2.1e-5);
    }

    #[test]
    fn the_last_requests_count_most_and_none_beyond_measure() {
        let mut calibration = Calibration::default();
        calibration.learn(COLD, 1e9);
        assert!(calibration.seconds(COLD) <= 50.3);
        for _ in 0..20 {
            calibration.learn(COLD, 0.1);
        }
        assert!((calibration.seconds(COLD) / 0.1 - 1.0).abs() < 1e-3);
    }
}
