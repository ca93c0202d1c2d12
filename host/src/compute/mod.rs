//! The compute threads and the only access to them: admission, lanes, cancellation, timing.
//!
//! FOUR LANES, by the cost of a job. A factorization uses every thread for seconds, while a query on a cached
//! factor takes microseconds. Each lane has a thread pool of its own. The operating system shares the cores
//! among them and prefers the lanes of small jobs.
//!
//! - light: parsing, planning, small clouds and chunks of answers. No large job can occupy these threads.
//! - shared: jobs between light and exclusive.
//! - exclusive: one large job at a time. Two factorizations side by side would take as long, and twice the
//!   memory.
//! - jobs: large jobs of `/v1/jobs`, for which nobody waits. Otherwise hours of such work would delay
//!   requests that have a deadline.
//!
//! OWNERS. Places and turns rotate among the owners, so that many requests of one owner do not delay those of
//! another.
//!
//! CANCELLATION. Dropping the future of a job tells the job to stop at its next checkpoint. The job keeps its
//! turn until it has really stopped, so no more work runs than was admitted.
//!
//! NOTHING WAITS ON A POOL. A thread that waits for parts of its job meanwhile executes another job, on top
//! of its stack. So a job must not wait for another job. While it calls on the pool, it must not hold
//! anything that another job may want: a lock, a cell or a channel. Whatever several jobs may need at once is
//! awaited before the job begins, through the flights of the store. clippy.toml forbids the calls that could
//! break this. Each exception states why it is safe.

mod calibration;
mod lane;
mod observer;
mod places;
mod progress;
mod pulse;
mod turns;

use std::sync::Arc;
use std::time::Duration;

use super::problem::Problem;
use crate::memory::Owner;
use calibration::Calibration;
pub use calibration::Work;
use lane::{Job, Lane, boxed};
pub use observer::{JobObserver, StageTimes};
pub use places::Admission;
use places::Places;
pub use progress::{Progress, Snapshot};
pub use turns::FairSemaphore;

/// Most flops of a job on the light lane: some 2 ms of one core.
const LIGHT_FLOPS: f64 = 3e7;

/// Most flops of a job on the shared lane: some 100 ms on two cores. Larger jobs go to the exclusive or jobs
/// lane.
const EXCLUSIVE_FLOPS: f64 = 1e10;

/// Cost of parsing, in flops per byte. It corresponds to a gigabyte a second.
pub const FLOPS_PER_PARSED_BYTE: f64 = 20.0;

/// Longest silence of a healthy lane. The checkpoints of the largest factorization are a second or two apart.
const STALL_TIMEOUT: Duration = Duration::from_secs(20);

/// Current load of the compute threads.
pub struct Load {
    /// Number of admitted requests, and the number of places for them.
    pub n_admitted: usize,
    pub n_places: usize,
    pub lanes: [LaneLoad; 4],
}

/// Number of jobs on a lane.
pub struct LaneLoad {
    pub name: &'static str,
    pub n_running: usize,
    pub n_waiting: usize,
}

/// Bounded compute threads behind a bounded queue.
pub struct Compute {
    light: Lane,
    shared: Lane,
    exclusive: Lane,
    jobs: Lane,
    places: Arc<Places>,
    n_threads: usize,
}

impl Compute {
    /// Starts the threads of all lanes.
    ///
    /// # Errors
    /// Fails if the operating system refuses the threads.
    pub fn new(
        n_threads: usize,
        max_queue: usize,
        n_owners: usize,
        deadline: Duration,
    ) -> Result<Self, rayon::ThreadPoolBuildError> {
        let n_places = n_threads.saturating_add(max_queue);
        Ok(Self {
            light: Lane::new("gramian-light", n_threads, FairSemaphore::new(n_threads), 0)?,
            shared: Lane::new("gramian-shared", n_threads, FairSemaphore::new(n_threads), 2)?,
            exclusive: Lane::new("gramian-exclusive", n_threads, FairSemaphore::new(1), 5)?,
            jobs: Lane::new("gramian-jobs", n_threads, FairSemaphore::of_owners(1, n_owners), 10)?,
            places: Places::new(n_places, n_owners, deadline, Calibration::new(n_threads)),
            n_threads,
        })
    }

    /// Number of threads of each lane.
    pub fn n_threads(&self) -> usize {
        self.n_threads
    }

    /// Returns the current load.
    pub fn load(&self) -> Load {
        let lanes = self.lanes().map(|(name, lane)| {
            let (n_running, n_waiting) = lane.load();
            LaneLoad { name, n_running, n_waiting }
        });
        let (n_admitted, n_places) = self.places.load();
        Load { n_admitted, n_places, lanes }
    }

    /// Takes a place for a request of this owner.
    ///
    /// # Errors
    /// 503 `overloaded` with Retry-After, if the queue is full.
    pub fn admit(&self, owner: Owner) -> Result<Arc<Admission>, Problem> {
        self.places.take(owner).map(Arc::new).map_err(Problem::overloaded)
    }

    /// Checks whether a request of this owner would be admitted, without taking a place.
    ///
    /// # Errors
    /// Returns the errors of [`Compute::admit`].
    pub fn check_room(&self, owner: Owner) -> Result<(), Problem> {
        self.places.look(owner).map_err(Problem::overloaded)
    }

    /// 503 `overloaded` for a request that does not fit in memory. Memory becomes free when the first running
    /// request ends.
    pub fn out_of_memory(&self) -> Problem {
        Problem::overloaded(self.places.seconds_until_any_is_free())
    }

    /// Checks that a request would be admitted, and that the threads of every lane make progress.
    ///
    /// # Errors
    /// 503 `overloaded` otherwise.
    pub async fn check_ready(&self) -> Result<(), Problem> {
        self.places.look_for_any().map_err(Problem::overloaded)?;
        for (_, lane) in self.lanes() {
            if !lane.is_moving(STALL_TIMEOUT).await {
                tracing::error!("the threads of a lane do not move");
                return Err(Problem::overloaded(STALL_TIMEOUT.as_secs()));
            }
        }
        Ok(())
    }

    /// Runs a job on the lane for its flops. Returns its result and the durations of its stages.
    ///
    /// # Errors
    /// 500 `internal` if the job panicked. The panic is logged and the threads live on.
    pub async fn run<T: Send + 'static>(
        &self,
        admission: &Admission,
        flops: f64,
        job: impl FnOnce(&JobObserver) -> T + Send + 'static,
    ) -> Result<(T, StageTimes), Problem> {
        let (job, result) = boxed(job);
        let times = self.run_job(admission, flops, job).await?;
        Ok((result.await.map_err(|_| panicked())?, times))
    }

    async fn run_job(&self, admission: &Admission, flops: f64, job: Job) -> Result<StageTimes, Problem> {
        let lane = self.lane(flops, admission.is_job());
        let turn = lane.turn(admission.owner).await;
        admission.begin();
        let times = lane.run(turn, admission.progress.clone(), job).await.ok_or_else(panicked)?;
        admission.worked(times.whole);
        if times.ended_early {
            admission.forget_work();
        }
        Ok(times)
    }

    /// Whether nothing runs or waits on the lane for work of so many flops.
    pub fn is_idle_for(&self, admission: &Admission, flops: f64) -> bool {
        self.lane(flops, admission.is_job()).load() == (0, 0)
    }

    /// Runs a job without a place, on the lane for its flops. The caller bounds the number of such jobs by
    /// other means: the memory that they hold, or one job per connection.
    ///
    /// So answers can be sent, and clouds be read and listed, while all places are taken.
    ///
    /// # Errors
    /// Returns the errors of [`Compute::run`].
    pub async fn run_without_place<T: Send + 'static>(
        &self,
        owner: Owner,
        flops: f64,
        job: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Problem> {
        let (job, result) = boxed(|_| job());
        self.run_job_without_place(owner, flops, job).await?;
        result.await.map_err(|_| panicked())
    }

    async fn run_job_without_place(&self, owner: Owner, flops: f64, job: Job) -> Result<(), Problem> {
        let lane = self.lane(flops, false);
        let turn = lane.turn(owner).await;
        lane.run(turn, None, job).await.map(drop).ok_or_else(panicked)
    }

    /// Runs a small job without a place ([`Compute::run_without_place`]).
    ///
    /// # Errors
    /// Returns the errors of [`Compute::run`].
    pub async fn run_small<T: Send + 'static>(
        &self,
        owner: Owner,
        job: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Problem> {
        self.run_without_place(owner, 0.0, job).await
    }

    fn lanes(&self) -> [(&'static str, &Lane); 4] {
        [
            ("light", &self.light),
            ("shared", &self.shared),
            ("exclusive", &self.exclusive),
            ("jobs", &self.jobs),
        ]
    }

    fn lane(&self, flops: f64, is_job: bool) -> &Lane {
        if flops > EXCLUSIVE_FLOPS {
            if is_job { &self.jobs } else { &self.exclusive }
        } else if !is_light(flops) {
            &self.shared
        } else {
            &self.light
        }
    }
}

/// Whether a job goes to the light lane.
pub fn is_light(flops: f64) -> bool {
    flops <= LIGHT_FLOPS
}

fn panicked() -> Problem {
    tracing::error!("a compute job panicked");
    Problem::internal()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::catalogue;
    use gramian_observer::Observer;
    use tokio::sync::oneshot;

    const OWNER: Owner = Owner(0);

    fn compute(max_queue: usize) -> (Compute, Arc<Admission>) {
        let compute = Compute::new(1, max_queue, 1, Duration::from_secs(100)).unwrap();
        let admission = compute.admit(OWNER).unwrap();
        (compute, admission)
    }

    #[tokio::test]
    async fn a_full_queue_is_refused_until_a_place_is_free() {
        let (compute, first) = compute(1);
        let _second = compute.admit(OWNER).unwrap();
        assert!(compute.check_room(OWNER).is_err() && compute.check_ready().await.is_err());
        assert_eq!(compute.admit(OWNER).err().map(|p| p.slug()), Some(catalogue::OVERLOADED));
        drop(first);
        assert!(compute.check_ready().await.is_ok() && compute.admit(OWNER).is_ok());
    }

    #[tokio::test]
    async fn a_panic_is_one_internal_error_and_the_pool_lives() {
        let (compute, admission) = compute(1);
        let outcome = compute
            .run(&admission, 0.0, |_| {
                if true {
                    panic!("a bug")
                }
            })
            .await;
        assert_eq!(outcome.err().map(|p| p.slug()), Some(catalogue::INTERNAL));
        assert_eq!(compute.run(&admission, 0.0, |_| 5).await.map(|found| found.0).ok(), Some(5));
    }

    #[tokio::test]
    async fn dropping_the_future_cancels_the_job() {
        let (compute, admission) = compute(1);
        let (began, has_begun) = oneshot::channel();
        let (stopped, has_stopped) = oneshot::channel();
        let mut job = Box::pin(compute.run(&admission, 1e12, move |observer| {
            began.send(()).unwrap();
            while !observer.is_cancelled() {
                std::thread::yield_now();
            }
            stopped.send(()).unwrap();
        }));
        assert!(futures_util::poll!(&mut job).is_pending());
        has_begun.await.unwrap();
        drop(job);
        has_stopped.await.unwrap();
    }

    #[tokio::test]
    async fn smaller_jobs_run_beside_larger_ones() {
        let (compute, admission) = compute(8);
        let (release, released) = std::sync::mpsc::channel::<()>();
        let (release_more, released_more) = std::sync::mpsc::channel::<()>();
        let mut large = Box::pin(compute.run(&admission, 1e12, move |_| released.recv().is_ok()));
        let mut larger = Box::pin(compute.run(&admission, 1e9, move |_| released_more.recv().is_ok()));
        assert!(
            futures_util::poll!(&mut large).is_pending() && futures_util::poll!(&mut larger).is_pending()
        );
        assert_eq!(compute.run(&admission, 1.0, |_| 3).await.map(|found| found.0).ok(), Some(3));
        assert_eq!(compute.run_small(OWNER, || 4).await.ok(), Some(4));
        release.send(()).unwrap();
        release_more.send(()).unwrap();
        assert_eq!(large.await.map(|found| found.0).ok(), Some(true));
        assert_eq!(larger.await.map(|found| found.0).ok(), Some(true));
    }
}
