//! A lane: threads, turns on them, and whether they still move.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::sync::oneshot;

use super::observer::{JobObserver, StageTimes};
use super::progress::Progress;
use super::pulse::Pulse;
use super::turns::{Turn, Turns};
use crate::store::Owner;

/// A pool of threads of its own with turns on it.
pub(super) struct Lane {
    pool: Arc<rayon::ThreadPool>,
    turns: Arc<Turns>,
    pulse: Arc<Pulse>,
}

impl Lane {
    /// Starts the threads. The operating system gives those of a greater `niceness` less of a core that others want as well.
    ///
    /// # Errors
    /// If the operating system refuses them.
    pub(super) fn new(
        name: &'static str,
        n_threads: usize,
        turns: Arc<Turns>,
        niceness: i32,
    ) -> Result<Self, rayon::ThreadPoolBuildError> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .thread_name(move |index| format!("{name}-{index}"))
            .start_handler(move |_| be_nice(niceness))
            .build()?;
        Ok(Self { pool: Arc::new(pool), turns, pulse: Pulse::new() })
    }

    /// Jobs that have their turn, and those that wait for one.
    pub(super) fn load(&self) -> (usize, usize) {
        self.turns.load()
    }

    /// Waits for a turn of this owner.
    pub(super) async fn turn(&self, owner: Owner) -> Turn {
        self.turns.take(owner).await
    }

    /// Runs a job to its end in a turn. Dropping the future tells the job to stop at its next checkpoint; it keeps its turn until
    /// then. `None` if it panicked.
    pub(super) async fn run<T: Send + 'static>(
        &self,
        turn: Turn,
        progress: Option<Arc<Progress>>,
        job: impl FnOnce(&JobObserver) -> T + Send + 'static,
    ) -> Option<(T, StageTimes)> {
        let (sender, receiver) = oneshot::channel();
        let cancelled = Arc::new(AtomicBool::new(false));
        let _cancel_on_drop = CancelOnDrop(cancelled.clone());
        let pulse = self.pulse.clone();
        self.pool.spawn(move || {
            pulse.beat();
            let observer = JobObserver::new(cancelled, pulse, progress);
            let outcome = catch_unwind(AssertUnwindSafe(|| job(&observer)));
            drop(turn);
            // The receiver is gone if the client is.
            let _ = sender.send(outcome.map(|result| (result, observer.times())));
        });
        receiver.await.ok()?.ok()
    }

    /// Whether the threads have moved within `patience`: a job has come to a checkpoint, or a probe through, which is sent here
    /// unless one is under way, and waited for a moment.
    pub(super) async fn is_moving(&self, patience: Duration) -> bool {
        if !self.pulse.is_probed.swap(true, Ordering::Relaxed) {
            let (pulse, (sender, receiver)) = (self.pulse.clone(), oneshot::channel::<()>());
            // An idle lane is silent; from here on something is asked of it.
            pulse.beat();
            self.pool.spawn(move || {
                pulse.is_probed.store(false, Ordering::Relaxed);
                pulse.beat();
                // The receiver is gone if the probe took long.
                let _ = sender.send(());
            });
            if tokio::time::timeout(PROBE_WAIT, receiver).await.is_ok() {
                return true;
            }
        }
        self.pulse.silence() <= patience
    }
}

/// How long a readiness probe waits for its answer; orchestrators wait a second by default.
const PROBE_WAIT: Duration = Duration::from_millis(100);

struct CancelOnDrop(Arc<AtomicBool>);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Where the operating system knows it by thread; a refusal changes no result.
#[cfg(target_os = "linux")]
fn be_nice(niceness: i32) {
    let _ = rustix::process::nice(niceness);
}

#[cfg(not(target_os = "linux"))]
fn be_nice(_niceness: i32) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_lane_whose_threads_wait_for_each_other_is_not_moving() {
        let lane = Lane::new("lane", 2, Turns::new(2), 0).unwrap();
        assert!(lane.is_moving(Duration::ZERO).await);
        let (release, released) = std::sync::mpsc::channel::<()>();
        let released = std::sync::Mutex::new(released);
        let stuck = Arc::new(released);
        for _ in 0..2 {
            let stuck = stuck.clone();
            lane.pool.spawn(move || assert!(stuck.lock().unwrap().recv().is_err()));
        }
        while lane.is_moving(Duration::from_millis(1)).await {}
        assert!(lane.is_moving(Duration::from_secs(600)).await);
        drop(release);
        while !lane.is_moving(Duration::ZERO).await {}
    }

    #[tokio::test]
    async fn a_lane_that_works_is_moving_however_long_the_work() {
        let lane = Lane::new("lane", 1, Turns::new(1), 0).unwrap();
        let (done, is_done) = std::sync::mpsc::channel::<()>();
        let work = move |observer: &JobObserver| {
            use gramian_numerics::observer::Observer;
            while is_done.try_recv().is_err() {
                assert!(observer.checkpoint().is_ok());
            }
        };
        let turn = lane.turn(Owner(0)).await;
        let mut running = Box::pin(lane.run(turn, None, work));
        assert!(futures_util::poll!(&mut running).is_pending());
        for _ in 0..3 {
            assert!(lane.is_moving(Duration::from_secs(5)).await);
        }
        done.send(()).unwrap();
        assert!(running.await.is_some());
    }
}
