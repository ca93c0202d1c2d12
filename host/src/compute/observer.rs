//! The observer of a job: measures its stages and tells it when its client has left.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::progress::Progress;
use super::pulse::Pulse;
use gramian_observer::{Observer, Stage};

/// Time spent in each stage of a job, and in all of it.
#[derive(Debug, Clone, Copy, Default)]
pub struct StageTimes {
    pub gram: Duration,
    pub factor: Duration,
    pub solve: Duration,
    pub evaluate: Duration,
    pub whole: Duration,
    /// Whether the work ended long before its price was spent ([`Observer::ended_early`]).
    pub ended_early: bool,
}

impl StageTimes {
    fn of(&mut self, stage: Stage) -> &mut Duration {
        match stage {
            Stage::Gram => &mut self.gram,
            Stage::Factor | Stage::Condition => &mut self.factor,
            Stage::Solve => &mut self.solve,
            Stage::Evaluate => &mut self.evaluate,
        }
    }
}

/// Measures the stages of a job and tells it when its client has left.
pub struct JobObserver {
    cancelled: Arc<AtomicBool>,
    pulse: Arc<Pulse>,
    /// Receives the stage and residual, if the request is watched.
    progress: Option<Arc<Progress>>,
    began: Instant,
    ended_early: AtomicBool,
    clock: Mutex<Clock>,
}

#[derive(Default)]
struct Clock {
    current: Option<(Stage, Instant)>,
    times: StageTimes,
}

impl Clock {
    fn stop(&mut self) {
        if let Some((stage, since)) = self.current.take() {
            *self.times.of(stage) += since.elapsed();
        }
    }
}

impl JobObserver {
    pub(super) fn new(
        cancelled: Arc<AtomicBool>,
        pulse: Arc<Pulse>,
        progress: Option<Arc<Progress>>,
    ) -> Self {
        let (began, ended_early) = (Instant::now(), AtomicBool::new(false));
        Self { cancelled, pulse, progress, began, ended_early, clock: Mutex::default() }
    }

    #[expect(clippy::disallowed_methods, reason = "a clock, for as long as it takes to read it")]
    fn clock(&self) -> MutexGuard<'_, Clock> {
        self.clock.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The durations so far, including that of the current stage.
    pub fn times(&self) -> StageTimes {
        let mut clock = self.clock();
        clock.stop();
        let ended_early = self.ended_early.load(Ordering::Relaxed);
        StageTimes { whole: self.began.elapsed(), ended_early, ..clock.times }
    }
}

impl Observer for JobObserver {
    fn enter(&self, stage: Stage) {
        let mut clock = self.clock();
        clock.stop();
        clock.current = Some((stage, Instant::now()));
        if let Some(progress) = &self.progress {
            progress.enter(stage);
        }
    }

    fn solved_to(&self, relative_residual: f64) {
        if let Some(progress) = &self.progress {
            progress.solved_to(relative_residual);
        }
    }

    fn ended_early(&self) {
        self.ended_early.store(true, Ordering::Relaxed);
    }

    fn is_cancelled(&self) -> bool {
        // Each call is a sign of life of the lane.
        self.pulse.beat();
        self.cancelled.load(Ordering::Relaxed)
    }
}
