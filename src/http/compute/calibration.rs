//! Predicted duration of work on this machine, learned from what ran on it.
//!
//! The nominal duration of a request is [`LEAST_SECONDS`] plus [`SECONDS_PER_FLOP`] times its flops, counted
//! before it begins. The ratio of measured to nominal duration is averaged per class: operation, cached or
//! not, and decade of flops.
//!
//! Averages are of logarithms, so that twice as long and half as long deviate equally. Each new request
//! halves the weight of all earlier ones, because the load of a machine changes.

use std::collections::HashMap;

/// Nominal seconds per flop: 20 Gflop/s.
const SECONDS_PER_FLOP: f64 = 5e-11;

/// Nominal seconds of the smallest request.
const LEAST_SECONDS: f64 = 2e-4;

/// Weight of the last request in the average of its class, and in the overall average.
///
/// The overall average stands in for classes without samples.
const WEIGHT: f64 = 0.5;
const WEIGHT_OF_ALL: f64 = 0.1;

/// Largest ratio that a sample counts with. If a process was stopped for an hour, that says nothing about the
/// next request.
const MOST: f64 = 1e3;

/// The properties of a request that determine its duration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Work {
    /// Name of the operation.
    pub operation: &'static str,
    /// Whether everything the request needs already exists, so that nothing must be made first.
    pub is_cached: bool,
    /// Flops of the request, counted before it begins.
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

/// Averages of ln(measured / nominal), per class and overall.
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

    /// Predicts the seconds that a request takes once its turn has come.
    pub(super) fn seconds(&self, work: Work) -> f64 {
        let of = |is_cached| self.nearest(work.operation, is_cached, work.decade());
        let known = of(work.is_cached).or_else(|| of(!work.is_cached));
        work.nominal_seconds() * known.unwrap_or(self.of_all).exp()
    }

    /// The average of the same operation in the nearest decade of flops.
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
        // A machine ten times as slow: learned at once for the same work and for similar work.
        calibration.learn(COLD, 0.502);
        assert!((calibration.seconds(COLD) - 0.502).abs() < 1e-12);
        assert!((calibration.seconds(Work { flops: 1e10, ..COLD }) - 5.002).abs() < 1e-9);
        assert!((calibration.seconds(Work { is_cached: true, ..COLD }) - 0.502).abs() < 1e-12);
        // Other operations take a tenth of the deviation over, in logarithms.
        let other = Work { operation: "compute_posterior", ..COLD };
        assert!((calibration.seconds(other) - 0.0502 * 10_f64.powf(0.1)).abs() < 1e-12);
        // Small requests do not affect the prediction of large ones.
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
