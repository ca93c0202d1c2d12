//! Predicted duration of work on this machine, learned from what ran on it.
//!
//! NOMINAL DURATION. It is [`LEAST_SECONDS`] plus [`SECONDS_PER_FLOP`] times the flops of a request, counted
//! before it begins. What is learned is ln(measured / nominal), per class: operation, cached or not, and
//! decade of flops. A class without samples is predicted by the nearest decade, or by the speed, which is
//! learned from all classes.
//!
//! BOUNDED STEPS. A sample moves its class by at most [`STEP`], and the speed by at most [`STEP_OF_SPEED`].
//! So one request that is priced wrong, or that found the machine busy, decides nothing. Predictions follow
//! the median of the last samples.
//!
//! SMALL WORK teaches nothing about large work. Its fixed costs are a large part of it, anyone can send
//! thousands of such requests, and only predictions of large work refuse a request.
//!
//! OWNERS learn apart. An owner without samples begins with the median speed of the others, as far as it is
//! within a factor of [`MOST_SHARED`]. So one owner changes the predictions for another by at most that.
//!
//! PEAK. No prediction is shorter than the flops take at the peak rate of the threads.

use std::collections::HashMap;

use crate::memory::Owner;

/// Nominal seconds per flop: 20 Gflop/s.
const SECONDS_PER_FLOP: f64 = 5e-11;

/// Nominal seconds of the smallest request.
const LEAST_SECONDS: f64 = 2e-4;

/// Flops per second of a thread that is never exceeded: two AVX-512 units at 2 GHz.
const PEAK_PER_THREAD: f64 = 6.4e10;

/// Nominal seconds from which on work is large.
const LARGE_SECONDS: f64 = 0.01;

/// Weight of the last sample in its class, and its largest step in logarithms: a factor of 1.6.
const WEIGHT: f64 = 0.5;
const STEP: f64 = 0.5;

/// Weight of the last sample in the speed, and its largest step.
const WEIGHT_OF_SPEED: f64 = 0.1;
const STEP_OF_SPEED: f64 = 0.1;

/// Part of a deviation from the speed that one decade predicts for the next.
const PER_DECADE: f64 = 0.5;

/// Largest factor by which the speeds of other owners change the first predictions for an owner.
const MOST_SHARED: f64 = 2.0;

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

    fn size(&self) -> Size {
        if self.nominal_seconds() < LARGE_SECONDS { Size::Small } else { Size::Large }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Size {
    Small,
    Large,
}

/// What was learned, per owner and size of work.
pub(super) struct Calibration {
    n_threads: usize,
    learned: HashMap<(Owner, Size), Speeds>,
}

/// Locations of ln(measured / nominal) of one owner: of all samples, and of each class.
struct Speeds {
    speed: f64,
    classes: HashMap<(&'static str, bool), Vec<(i32, f64)>>,
}

impl Calibration {
    pub(super) fn new(n_threads: usize) -> Self {
        Self { n_threads, learned: HashMap::new() }
    }

    /// Learns from a request that was answered.
    pub(super) fn learn(&mut self, owner: Owner, work: Work, seconds: f64) {
        let seconds = seconds.max(self.least_seconds(work));
        let sample = (seconds / work.nominal_seconds()).ln();
        let speed = self.shared_speed(work.size());
        let learned = self.learned.entry((owner, work.size()));
        learned.or_insert_with(|| Speeds { speed, classes: HashMap::new() }).learn(work, sample);
    }

    /// Predicts the seconds that a request of an owner takes once its turn has come.
    pub(super) fn seconds(&self, owner: Owner, work: Work) -> f64 {
        let location = match self.learned.get(&(owner, work.size())) {
            Some(learned) => learned.location(work),
            None => self.shared_speed(work.size()),
        };
        (work.nominal_seconds() * location.exp()).max(self.least_seconds(work))
    }

    fn least_seconds(&self, work: Work) -> f64 {
        work.flops / (PEAK_PER_THREAD * self.n_threads as f64)
    }

    /// The median speed of all owners, within the bound.
    fn shared_speed(&self, size: Size) -> f64 {
        let of_size = self.learned.iter().filter(|((_, of), _)| *of == size);
        let mut speeds: Vec<f64> = of_size.map(|(_, learned)| learned.speed).collect();
        speeds.sort_by(f64::total_cmp);
        let median = speeds.get(speeds.len() / 2).copied().unwrap_or(0.0);
        median.clamp(-MOST_SHARED.ln(), MOST_SHARED.ln())
    }
}

impl Speeds {
    fn learn(&mut self, work: Work, sample: f64) {
        let prior = self.location(work);
        let decades = self.classes.entry((work.operation, work.is_cached)).or_default();
        let known = decades.iter_mut().find(|(decade, _)| *decade == work.decade());
        match known {
            Some((_, location)) => *location += step(WEIGHT, sample - *location, STEP),
            None => decades.push((work.decade(), prior + step(WEIGHT, sample - prior, STEP))),
        }
        self.speed += step(WEIGHT_OF_SPEED, sample - self.speed, STEP_OF_SPEED);
    }

    fn location(&self, work: Work) -> f64 {
        let of = |is_cached| self.nearest((work.operation, is_cached), work.decade());
        of(work.is_cached).or_else(|| of(!work.is_cached)).unwrap_or(self.speed)
    }

    /// The location of the nearest decade with samples, closer to the speed the farther it is.
    fn nearest(&self, class: (&'static str, bool), decade: i32) -> Option<f64> {
        let distance = |known: i32| (known - decade).abs();
        let (known, location) =
            self.classes.get(&class)?.iter().min_by_key(|(known, _)| distance(*known)).copied()?;
        Some(self.speed + PER_DECADE.powi(distance(known)) * (location - self.speed))
    }
}

fn step(weight: f64, deviation: f64, most: f64) -> f64 {
    (weight * deviation).clamp(-most, most)
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Owner = Owner(0);
    const B: Owner = Owner(1);
    const COLD: Work = Work { operation: "compute_normals", is_cached: false, flops: 1e9 };
    const SMALL: Work = Work { flops: 1e4, ..COLD };
    const NOMINAL: f64 = 0.0502;

    /// Learns until predictions no longer move.
    fn taught(owner: Owner, work: Work, seconds: f64) -> Calibration {
        let mut calibration = Calibration::new(2);
        teach(&mut calibration, owner, work, seconds);
        calibration
    }

    fn teach(calibration: &mut Calibration, owner: Owner, work: Work, seconds: f64) {
        for _ in 0..100 {
            calibration.learn(owner, work, seconds);
        }
    }

    fn is_about(found: f64, expected: f64) -> bool {
        (found / expected).ln().abs() < 1e-3
    }

    #[test]
    fn what_ran_tells_how_long_the_next_one_takes() {
        assert!(is_about(Calibration::new(2).seconds(A, COLD), NOMINAL));
        // A machine ten times as slow. Other operations take its speed over, and the same work is known best.
        let calibration = taught(A, COLD, 10.0 * NOMINAL);
        for work in [
            COLD,
            Work { is_cached: true, ..COLD },
            Work { operation: "compute_posterior", ..COLD },
            Work { flops: 1e12, ..COLD },
        ] {
            assert!(is_about(calibration.seconds(A, work), 10.0 * work.nominal_seconds()), "{work:?}");
        }
        assert!(is_about(calibration.seconds(A, SMALL), SMALL.nominal_seconds()));
    }

    #[test]
    fn one_sample_moves_a_prediction_by_a_bounded_step() {
        for seconds in [0.0, 1e-9, 1e9, f64::INFINITY] {
            let mut calibration = taught(A, COLD, NOMINAL);
            calibration.learn(A, COLD, seconds);
            for (work, most) in [(COLD, 1.65), (Work { operation: "compute_posterior", ..COLD }, 1.11)] {
                let factor = calibration.seconds(A, work) / NOMINAL;
                assert!((1.0 / most..=most).contains(&factor), "{seconds} s: {factor}");
            }
        }
    }

    #[test]
    fn a_minority_of_samples_decides_nothing() {
        let mut calibration = taught(A, COLD, NOMINAL);
        for k in 0..400 {
            calibration.learn(A, COLD, if k % 4 == 0 { 1e6 } else { NOMINAL });
        }
        let factor = calibration.seconds(A, COLD) / NOMINAL;
        assert!((0.5..=2.0).contains(&factor), "{factor}");
    }

    #[test]
    fn small_work_says_nothing_of_large_work() {
        let calibration = taught(A, SMALL, 100.0);
        assert!(calibration.seconds(A, SMALL) > 10.0);
        assert!(is_about(calibration.seconds(A, COLD), NOMINAL));
        assert!(is_about(calibration.seconds(B, COLD), NOMINAL));
    }

    #[test]
    fn a_class_says_little_of_one_a_thousand_times_as_large() {
        let mut calibration = taught(A, Work { operation: "compute_posterior", ..COLD }, NOMINAL);
        for _ in 0..10 {
            calibration.learn(A, COLD, 100.0 * NOMINAL);
        }
        let large = Work { flops: 1e12, ..COLD };
        let factor = calibration.seconds(A, large) / large.nominal_seconds();
        assert!(factor < 10.0 && calibration.seconds(A, COLD) > 50.0 * NOMINAL, "{factor}");
    }

    #[test]
    fn an_owner_changes_the_predictions_for_another_by_at_most_a_factor_of_two() {
        for seconds in [1e-9, 1e9] {
            for work in [COLD, SMALL] {
                // One who has computed nothing, and one who knows better.
                let mut calibration = taught(A, work, seconds);
                let factor = calibration.seconds(B, work) / work.nominal_seconds();
                assert!((0.499..=2.001).contains(&factor), "{factor}");
                teach(&mut calibration, B, work, 3.0 * work.nominal_seconds());
                teach(&mut calibration, A, work, seconds);
                assert!(is_about(calibration.seconds(B, work), 3.0 * work.nominal_seconds()));
            }
        }
    }

    #[test]
    fn nothing_is_predicted_to_exceed_the_peak_rate() {
        let calibration = taught(A, COLD, 0.0);
        assert!(is_about(calibration.seconds(A, COLD), 1e9 / 1.28e11));
        // Samples beyond it are no further away than it is: the next ones correct them.
        let mut calibration = taught(A, COLD, 0.0);
        for _ in 0..10 {
            calibration.learn(A, COLD, NOMINAL);
        }
        assert!(calibration.seconds(A, COLD) > 0.5 * NOMINAL);
    }
}
