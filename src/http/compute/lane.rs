//! A lane: threads, turns on them, and whether they still move.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use tokio::sync::oneshot;

use super::observer::{JobObserver, StageTimes};
use super::progress::Progress;
use super::pulse::Pulse;
use super::turns::{Turn, Turns};
use crate::store::Owner;

/// Threads of its own with turns on them.
pub(super) struct Lane {
    n_turns: usize,
    seats: Arc<Seats>,
    turns: Arc<Turns>,
    pulse: Arc<Pulse>,
}

/// What threads a lane has.
pub(super) enum Threads {
    /// One pool of so many, which the jobs that have a turn share.
    Shared(usize),
    /// One for each job that has a turn. A job that hands parts of itself to another thread waits until the system has
    /// given that one a core: beside heavy work some 10 ms, more than all the work of a small job.
    OneEach,
}

impl Lane {
    /// Starts the threads. The operating system gives those of a greater `niceness` less of a core that others want as well.
    ///
    /// # Errors
    /// If the operating system refuses them.
    pub(super) fn new(
        name: &'static str,
        threads: Threads,
        n_turns: usize,
        niceness: i32,
    ) -> Result<Self, ThreadPoolBuildError> {
        let pool = |first: usize, n_threads| {
            let builder = ThreadPoolBuilder::new()
                .num_threads(n_threads)
                .thread_name(move |index| format!("{name}-{}", first + index))
                .start_handler(move |_| be_nice(niceness));
            Ok(Arc::new(builder.build()?))
        };
        let first = pool(0, if let Threads::Shared(n_threads) = threads { n_threads } else { 1 })?;
        let mut free = vec![first.clone()];
        for seat in 1..n_turns {
            free.push(if let Threads::Shared(_) = threads { first.clone() } else { pool(seat, 1)? });
        }
        let seats = Arc::new(Seats { first, free: Mutex::new(free) });
        Ok(Self { n_turns, seats, turns: Turns::new(n_turns), pulse: Pulse::new() })
    }

    /// Jobs that have their turn, and those that wait for one.
    pub(super) fn load(&self) -> (usize, usize) {
        self.turns.load(self.n_turns)
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
        let (pulse, seats, pool) = (self.pulse.clone(), self.seats.clone(), self.seats.take());
        pool.clone().spawn(move || {
            pulse.beat();
            let observer = JobObserver::new(cancelled, pulse, progress);
            let outcome = catch_unwind(AssertUnwindSafe(|| job(&observer)));
            seats.give_back(pool);
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
            self.seats.free_or_first().spawn(move || {
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

/// A pool for each turn; where a lane has one pool, that one as often.
struct Seats {
    first: Arc<ThreadPool>,
    free: Mutex<Vec<Arc<ThreadPool>>>,
}

impl Seats {
    /// A free one, which there is for whoever has a turn: pools are given back before turns are.
    fn take(&self) -> Arc<ThreadPool> {
        self.free().pop().unwrap_or_else(|| self.first.clone())
    }

    fn give_back(&self, pool: Arc<ThreadPool>) {
        self.free().push(pool);
    }

    /// A free one if there is any, to look at.
    fn free_or_first(&self) -> Arc<ThreadPool> {
        self.free().last().unwrap_or(&self.first).clone()
    }

    #[expect(clippy::disallowed_methods, reason = "a list, for as long as it takes to look at its end")]
    fn free(&self) -> MutexGuard<'_, Vec<Arc<ThreadPool>>> {
        self.free.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

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
        for threads in [Threads::Shared(2), Threads::OneEach] {
            let lane = Lane::new("lane", threads, 2, 0).unwrap();
            assert!(lane.is_moving(Duration::ZERO).await);
            let mut stuck = Vec::new();
            for _ in 0..2 {
                let (release, released) = std::sync::mpsc::channel::<()>();
                let turn = lane.turn(Owner(0)).await;
                let mut job = Box::pin(lane.run(turn, None, move |_| released.recv().is_ok()));
                assert!(futures_util::poll!(&mut job).is_pending());
                stuck.push((release, job));
            }
            while lane.is_moving(Duration::from_millis(1)).await {}
            assert!(lane.is_moving(Duration::from_secs(600)).await);
            for (release, job) in stuck {
                release.send(()).unwrap();
                assert_eq!(job.await.map(|found| found.0), Some(true));
            }
            while !lane.is_moving(Duration::ZERO).await {}
        }
    }

    #[tokio::test]
    async fn jobs_with_a_thread_each_neither_wake_another_nor_wait_for_one() {
        let lane = Lane::new("lane", Threads::OneEach, 3, 0).unwrap();
        // Each waits until all of them run, so that they need a thread each.
        let barrier = Arc::new(std::sync::Barrier::new(3));
        for _ in 0..2 {
            let mut jobs = Vec::new();
            for _ in 0..3 {
                let (barrier, turn) = (barrier.clone(), lane.turn(Owner(0)).await);
                let job = move |_: &JobObserver| (rayon::current_num_threads(), barrier.wait().is_leader());
                jobs.push(lane.run(turn, None, job));
            }
            let found = futures_util::future::join_all(jobs).await;
            let n_threads = found.iter().flatten().map(|((n, _), _)| *n).collect::<Vec<_>>();
            assert_eq!(n_threads, [1, 1, 1]);
        }
        assert_eq!(lane.load(), (0, 0));
        assert_eq!(lane.seats.free().len(), 3);
    }

    #[tokio::test]
    async fn a_lane_that_works_is_moving_however_long_the_work() {
        let lane = Lane::new("lane", Threads::Shared(1), 1, 0).unwrap();
        let (done, is_done) = std::sync::mpsc::channel::<()>();
        let work = move |observer: &JobObserver| {
            use crate::numerics::observer::Observer;
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
