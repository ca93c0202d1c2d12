//! Progress of a request while it is served. Only jobs are watched.
//!
//! Progress consists of the stage and of the elapsed part of the expected time. A request that takes longer
//! than expected approaches its end asymptotically and never reaches it.

use std::future::Future;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use gramian_observer::Stage;

tokio::task_local! {
    static WATCHED: Arc<Progress>;
}

/// Fraction of the expected time up to which progress is linear in time. The rest is left for requests that
/// are late.
const TIMELY: f64 = 0.9;

/// Progress of a request, written by its job and read by watchers.
#[derive(Default)]
pub struct Progress {
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    stage: Option<Stage>,
    residual: Option<f64>,
    /// Seconds that the request is expected to take.
    expected: Option<f64>,
    /// When the request began.
    begun: Option<Instant>,
    /// Largest fraction reported so far, because progress never goes back.
    fraction: f64,
}

/// Progress at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Snapshot {
    /// `None` until the first stage begins.
    pub stage: Option<Stage>,
    /// Between 0 and 1.
    pub fraction: f64,
    /// Relative residual of the last solve.
    pub residual: Option<f64>,
    pub seconds_left: Option<f64>,
}

impl Progress {
    /// Runs a request as a watched one.
    pub async fn watch<F: Future>(self: &Arc<Self>, request: F) -> F::Output {
        WATCHED.scope(self.clone(), request).await
    }

    /// The progress of the request that this task serves, if it is watched.
    pub(super) fn of_this_task() -> Option<Arc<Self>> {
        WATCHED.try_with(Arc::clone).ok()
    }

    pub(super) fn expect(&self, seconds: f64) {
        self.state().expected = Some(seconds);
    }

    pub(super) fn begin(&self) {
        let mut state = self.state();
        if state.expected.is_some() {
            state.begun.get_or_insert_with(Instant::now);
        }
    }

    pub(super) fn enter(&self, stage: Stage) {
        self.state().stage = Some(stage);
    }

    pub(super) fn solved_to(&self, relative_residual: f64) {
        // A residual beyond float64 is no measure of progress.
        self.state().residual = Some(relative_residual).filter(|residual| residual.is_finite());
    }

    /// Resets the progress of a request that was refused and is tried again.
    pub fn restart(&self) {
        *self.state() = State::default();
    }

    /// Returns the current progress.
    pub fn now(&self) -> Snapshot {
        let mut state = self.state();
        let elapsed = state.begun.map(|begun| begun.elapsed().as_secs_f64());
        let known = elapsed.zip(state.expected);
        let seconds_left = known.map(|(elapsed, expected)| {
            state.fraction = state.fraction.max(fraction(elapsed / expected.max(1e-6)));
            if elapsed < TIMELY * expected {
                expected - elapsed
            } else {
                elapsed * (1.0 - state.fraction) / state.fraction
            }
        });
        let State { stage, residual, fraction, .. } = *state;
        Snapshot { stage, fraction, residual, seconds_left }
    }

    #[expect(clippy::disallowed_methods, reason = "a few numbers, for as long as it takes to read them")]
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Converts elapsed / expected time to progress: the identity up to 0.9, then ever slower towards 1.
fn fraction(of_expected: f64) -> f64 {
    match of_expected - TIMELY {
        late if late > 0.0 => 1.0 - (1.0 - TIMELY) / (1.0 + late / (1.0 - TIMELY)),
        _ => of_expected,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_takes_longer_comes_ever_closer_to_its_end() {
        assert_eq!((fraction(0.0), fraction(0.5)), (0.0, 0.5));
        let at: Vec<f64> = [0.89, 0.9, 0.91, 1.0, 2.0, 100.0].map(fraction).to_vec();
        assert!(at.windows(2).all(|pair| pair[0] < pair[1]) && at[5] < 1.0, "{at:?}");
        assert!((fraction(0.9 + 1e-9) - 0.9).abs() < 1e-8);
        assert!((fraction(1.0) - 0.95).abs() < 1e-12);
    }

    #[tokio::test]
    async fn only_who_is_watched_is_seen() {
        let progress = Arc::new(Progress::default());
        assert!(Progress::of_this_task().is_none());
        progress.watch(async { Progress::of_this_task().unwrap().enter(Stage::Factor) }).await;
        let nothing =
            Snapshot { stage: Some(Stage::Factor), fraction: 0.0, residual: None, seconds_left: None };
        assert_eq!(progress.now(), nothing);
        // There is no prediction without an expected time.
        progress.begin();
        assert_eq!(progress.now(), nothing);
        progress.expect(1e9);
        progress.begin();
        progress.solved_to(1e-12);
        let now = progress.now();
        assert!(now.fraction < 1e-6 && now.seconds_left.is_some_and(|left| left > 9e8), "{now:?}");
        assert_eq!(now.residual, Some(1e-12));
        progress.solved_to(f64::INFINITY);
        assert_eq!(progress.now().residual, None);
        progress.restart();
        assert_eq!(progress.now(), Snapshot { stage: None, ..nothing });
    }
}
