//! The only door to the compute threads: admission, lanes, cancellation, timing.
//!
//! FOUR LANES, by what a job costs. A factorization uses every thread for seconds, a warm query takes microseconds. Each lane
//! has a thread pool of its own, so that the operating system shares the cores, and prefers the lanes of small jobs: parsing
//! and planning, small clouds and the chunks of answers run on threads that no work of size can take. The exclusive lane runs
//! one job at a time: two factorizations side by side would take as long and twice the memory. What costs as much and nobody waits for, work
//! of `/v1/jobs`, has a lane of its own behind all others, or hours of it would be in front of requests with a deadline.
//!
//! OWNERS. Places and turns go round among the owners, so that many requests of one do not hold up those of another.
//!
//! CANCELLATION. Dropping the future of a job tells the job to stop at its next checkpoint. It keeps its turn until it has
//! really stopped, so no more work runs than was admitted.
//!
//! NOTHING WAITS ON A POOL. A thread that waits for the parts of its job takes up another job meanwhile, on top of its stack. So
//! a job neither waits for another job nor holds, while it calls on the pool, what another job may want: lock, cell or
//! channel. What many may want at once is awaited before the job begins, through the flights of the store. clippy.toml
//! refuses the calls that could break this; each exception says why it is none.

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
use crate::store::Owner;
pub use calibration::Work;
use lane::Lane;
pub use observer::{JobObserver, StageTimes};
pub use places::Admission;
use places::Places;
pub use progress::{Progress, Snapshot};
pub use turns::Turns;

/// Flops up to which a job goes to the light lane: some 2 ms of one core.
const LIGHT_FLOPS: f64 = 3e7;

/// Flops beyond which a job goes to the exclusive lane: some 100 ms on two cores.
const EXCLUSIVE_FLOPS: f64 = 1e10;

/// What parsing a byte takes, in flops of a light job: a gigabyte a second.
pub const FLOPS_PER_PARSED_BYTE: f64 = 20.0;

/// How long a lane may be without any sign of life: between two checkpoints of the largest factorization lies a second or two.
const PATIENCE: Duration = Duration::from_secs(20);

/// What there is to do at a moment.
pub struct Load {
    /// Requests that have a place, and how many places there are.
    pub n_admitted: usize,
    pub n_places: usize,
    pub lanes: [LaneLoad; 4],
}

/// Jobs of a lane.
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
    /// If the operating system refuses them.
    pub fn new(
        n_threads: usize,
        max_queue: usize,
        n_owners: usize,
        deadline: Duration,
    ) -> Result<Self, rayon::ThreadPoolBuildError> {
        Ok(Self {
            light: Lane::new("gramian-light", n_threads, Turns::new(n_threads), 0)?,
            shared: Lane::new("gramian-shared", n_threads, Turns::new(n_threads), 2)?,
            exclusive: Lane::new("gramian-exclusive", n_threads, Turns::new(1), 5)?,
            jobs: Lane::new("gramian-jobs", n_threads, Turns::of_owners(1, n_owners), 10)?,
            places: Places::new(n_threads.saturating_add(max_queue), n_owners, deadline),
            n_threads,
        })
    }

    /// Threads of each lane.
    pub fn n_threads(&self) -> usize {
        self.n_threads
    }

    /// What there is to do now.
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
    /// 503 `overloaded` when as many requests wait as may, with when to come back.
    pub fn admit(&self, owner: Owner) -> Result<Arc<Admission>, Problem> {
        self.places.take(owner).map(Arc::new).map_err(Problem::overloaded)
    }

    /// Looks whether a request of this owner would be admitted.
    ///
    /// # Errors
    /// Those of [`Compute::admit`].
    pub fn check_room(&self, owner: Owner) -> Result<(), Problem> {
        self.places.look(owner).map_err(Problem::overloaded)
    }

    /// 503 `overloaded` for what is short of memory: some is free when the first of the requests under way has ended.
    pub fn out_of_memory(&self) -> Problem {
        Problem::overloaded(self.places.seconds_until_any_is_free())
    }

    /// Looks whether any request would be admitted, and whether the threads of every lane move.
    ///
    /// # Errors
    /// 503 `overloaded`.
    pub async fn check_ready(&self) -> Result<(), Problem> {
        self.places.look_for_any().map_err(Problem::overloaded)?;
        for (_, lane) in self.lanes() {
            if !lane.is_moving(PATIENCE).await {
                tracing::error!("the threads of a lane do not move");
                return Err(Problem::overloaded(PATIENCE.as_secs()));
            }
        }
        Ok(())
    }

    /// Runs a job on the lane for its flops and answers with its result and the time of its stages.
    ///
    /// # Errors
    /// 500 `internal` if the job panicked; the panic is logged and the threads live on.
    pub async fn run<T: Send + 'static>(
        &self,
        admission: &Admission,
        flops: f64,
        job: impl FnOnce(&JobObserver) -> T + Send + 'static,
    ) -> Result<(T, StageTimes), Problem> {
        let lane = self.lane(flops, admission.is_job());
        let turn = lane.turn(admission.owner).await;
        admission.begin();
        lane.run(turn, admission.progress.clone(), job).await.ok_or_else(panicked)
    }

    /// Runs a small job of an answer that is on its way, when its place is another's already.
    ///
    /// # Errors
    /// Those of [`Compute::run`].
    pub async fn run_small<T: Send + 'static>(
        &self,
        owner: Owner,
        job: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Problem> {
        let turn = self.light.turn(owner).await;
        let (result, _) = self.light.run(turn, None, |_| job()).await.ok_or_else(panicked)?;
        Ok(result)
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

/// Whether a job of so many flops goes to the lane of the smallest.
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
    use crate::http::problem::slug::Slug;
    use gramian_numerics::observer::Observer;
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
        assert_eq!(compute.admit(OWNER).err().map(|p| p.slug()), Some(Slug::Overloaded));
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
        assert_eq!(outcome.err().map(|p| p.slug()), Some(Slug::Internal));
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
