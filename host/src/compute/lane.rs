//! A lane: a thread pool, the turns on it, and a check that its threads still make progress.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use tokio::sync::oneshot;

use super::observer::{JobObserver, StageTimes};
use super::progress::Progress;
use super::pulse::Pulse;
use super::turns::{FairSemaphore, Turn};
use crate::memory::Owner;

/// A job for the threads. Boxed, so that code for running one exists once, whatever the job and its result.
pub(super) type Job = Box<dyn FnOnce(&JobObserver) + Send>;

/// Boxes a job, which sends its result before it ends.
pub(super) fn boxed<T: Send + 'static>(
    job: impl FnOnce(&JobObserver) -> T + Send + 'static,
) -> (Job, oneshot::Receiver<T>) {
    let (sender, receiver) = oneshot::channel();
    // Sending fails if the client has left.
    (Box::new(move |observer| _ = sender.send(job(observer))), receiver)
}

/// A thread pool with turns.
pub(super) struct Lane {
    pool: Arc<rayon::ThreadPool>,
    turns: Arc<FairSemaphore>,
    pulse: Arc<Pulse>,
}

impl Lane {
    /// Starts the threads. When cores are contended, the operating system gives threads with a greater
    /// `niceness` less time.
    ///
    /// # Errors
    /// Fails if the operating system refuses the threads.
    pub(super) fn new(
        name: &'static str,
        n_threads: usize,
        turns: Arc<FairSemaphore>,
        niceness: i32,
    ) -> Result<Self, rayon::ThreadPoolBuildError> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .thread_name(move |index| format!("{name}-{index}"))
            .start_handler(move |_| be_nice(niceness))
            .build()?;
        Ok(Self { pool: Arc::new(pool), turns, pulse: Pulse::new() })
    }

    /// Returns the number of running jobs and the number of waiting jobs.
    pub(super) fn load(&self) -> (usize, usize) {
        self.turns.load()
    }

    /// Waits for a turn of this owner.
    pub(super) async fn turn(&self, owner: Owner) -> Turn {
        self.turns.take(owner).await
    }

    /// Runs a job to its end in a turn, and returns the durations of its stages. `None` if it panicked.
    ///
    /// Dropping the future tells the job to stop at its next checkpoint. The job keeps its turn until then.
    pub(super) async fn run(
        &self,
        turn: Turn,
        progress: Option<Arc<Progress>>,
        job: Job,
    ) -> Option<StageTimes> {
        let (sender, receiver) = oneshot::channel();
        let cancelled = Arc::new(AtomicBool::new(false));
        let _cancel_on_drop = CancelOnDrop(cancelled.clone());
        let pulse = self.pulse.clone();
        self.pool.spawn(move || {
            pulse.beat();
            let observer = JobObserver::new(cancelled, pulse, progress);
            let outcome = catch_unwind(AssertUnwindSafe(|| job(&observer)));
            drop(turn);
            // Sending fails if the client has left.
            let _ = sender.send(outcome.map(|()| observer.times()));
        });
        receiver.await.ok()?.ok()
    }

    /// Whether the threads have made progress within `timeout`.
    ///
    /// Progress is a job that reached a checkpoint, or a probe that ran. This function sends a probe unless
    /// another is pending, and waits [`PROBE_WAIT`] for it.
    pub(super) async fn is_moving(&self, timeout: Duration) -> bool {
        if !self.pulse.is_probed.swap(true, Ordering::Relaxed) {
            let (pulse, (sender, receiver)) = (self.pulse.clone(), oneshot::channel::<()>());
            // An idle lane gives no sign of life, so its silence is measured from here.
            pulse.beat();
            self.pool.spawn(move || {
                pulse.is_probed.store(false, Ordering::Relaxed);
                pulse.beat();
                // Sending fails if the probe was late.
                let _ = sender.send(());
            });
            if tokio::time::timeout(PROBE_WAIT, receiver).await.is_ok() {
                return true;
            }
        }
        self.pulse.silence() <= timeout
    }
}

/// Time that a readiness check waits for its probe. Orchestrators wait a second by default.
const PROBE_WAIT: Duration = Duration::from_millis(100);

struct CancelOnDrop(Arc<AtomicBool>);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Sets the niceness of the current thread on Linux, which has it per thread. A refusal changes no result.
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
        let lane = Lane::new("lane", 2, FairSemaphore::new(2), 0).unwrap();
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
    async fn a_turn_is_free_once_its_result_is_there() {
        let lane = Lane::new("lane", 1, FairSemaphore::new(1), 0).unwrap();
        let (job, result) = boxed(|_| 7);
        let turn = lane.turn(Owner(0)).await;
        assert_eq!(lane.load(), (1, 0));
        assert!(lane.run(turn, None, job).await.is_some());
        assert_eq!((lane.load(), result.await), ((0, 0), Ok(7)));
    }

    #[tokio::test]
    async fn a_lane_that_works_is_moving_however_long_the_work() {
        let lane = Lane::new("lane", 1, FairSemaphore::new(1), 0).unwrap();
        let (done, is_done) = std::sync::mpsc::channel::<()>();
        let work = move |observer: &JobObserver| {
            use gramian_observer::Observer;
            while is_done.try_recv().is_err() {
                assert!(observer.checkpoint().is_ok());
            }
        };
        let turn = lane.turn(Owner(0)).await;
        let mut running = Box::pin(lane.run(turn, None, boxed(work).0));
        assert!(futures_util::poll!(&mut running).is_pending());
        for _ in 0..3 {
            assert!(lane.is_moving(Duration::from_secs(5)).await);
        }
        done.send(()).unwrap();
        assert!(running.await.is_some());
    }
}
