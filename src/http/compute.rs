//! The only door to the compute pool: admission, lanes, cancellation, timing.
//!
//! TWO LANES. A factorization uses every thread for seconds; a warm query takes microseconds. Each lane has a thread pool of
//! its own, so that the operating system shares the cores fairly and small requests are answered while a large one runs. The
//! exclusive lane runs one job at a time: two factorizations side by side would take as long and twice the memory.
//!
//! CANCELLATION. Dropping the future of a job tells the job to stop at its next block. It keeps its permit until it has
//! really stopped, so no more work runs than was admitted.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::{OwnedSemaphorePermit, Semaphore, SemaphorePermit, oneshot};

use super::problem::Problem;
use crate::numerics::observer::{Observer, Stage};

/// Flops beyond which a job goes to the exclusive lane: some 100 ms on two cores.
const EXCLUSIVE_FLOPS: f64 = 1e10;

/// Bounded compute threads behind a bounded queue.
pub struct Compute {
    exclusive: Lane,
    shared: Lane,
    /// KiB of factorizations that requests may hold beside the cache.
    memory: Semaphore,
    memory_kib: u32,
    places: Arc<Semaphore>,
    n_places: usize,
    n_threads: usize,
    /// Moving average of the seconds an admitted request stays, as the bits of an f64.
    mean_seconds: AtomicU64,
}

struct Lane {
    pool: Arc<rayon::ThreadPool>,
    permits: Arc<Semaphore>,
}

impl Lane {
    fn new(name: &'static str, n_threads: usize, n_jobs: usize) -> Result<Self, rayon::ThreadPoolBuildError> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .thread_name(move |index| format!("{name}-{index}"))
            .build()?;
        Ok(Self { pool: Arc::new(pool), permits: Arc::new(Semaphore::new(n_jobs)) })
    }
}

/// A place among the admitted requests, held until the answer is ready.
pub struct Admission<'a> {
    compute: &'a Compute,
    since: Instant,
    _place: OwnedSemaphorePermit,
}

impl Drop for Admission<'_> {
    fn drop(&mut self) {
        let sample = self.since.elapsed().as_secs_f64();
        let mean = f64::from_bits(self.compute.mean_seconds.load(Ordering::Relaxed));
        let next = if mean == 0.0 { sample } else { 0.8 * mean + 0.2 * sample };
        self.compute.mean_seconds.store(next.to_bits(), Ordering::Relaxed);
    }
}

impl Compute {
    /// Starts the threads of both lanes.
    ///
    /// # Errors
    /// If the operating system refuses them.
    pub fn new(
        n_threads: usize,
        max_queue: usize,
        memory_bytes: u64,
    ) -> Result<Self, rayon::ThreadPoolBuildError> {
        // Tokio counts permits in 32 bits when several are taken at once: KiB reach 4 TiB.
        let memory_kib = u32::try_from(memory_bytes / 1024).unwrap_or(u32::MAX).max(1);
        let n_places = n_threads.saturating_add(max_queue).min(Semaphore::MAX_PERMITS);
        Ok(Self {
            exclusive: Lane::new("gramian-exclusive", n_threads, 1)?,
            shared: Lane::new("gramian-shared", n_threads, n_threads)?,
            memory: Semaphore::new(memory_kib as usize),
            memory_kib,
            places: Arc::new(Semaphore::new(n_places)),
            n_places,
            n_threads,
            mean_seconds: AtomicU64::new(0),
        })
    }

    /// Takes a place, or answers when to come back: as many requests as have places, divided over the threads.
    ///
    /// # Errors
    /// 503 `overloaded` when as many requests wait as may.
    pub fn admit(&self) -> Result<Admission<'_>, Problem> {
        match self.places.clone().try_acquire_owned() {
            Ok(place) => Ok(Admission { compute: self, since: Instant::now(), _place: place }),
            Err(_) => {
                let mean = f64::from_bits(self.mean_seconds.load(Ordering::Relaxed));
                let wait = mean * self.n_places as f64 / self.n_threads as f64;
                Err(Problem::overloaded(wait.ceil().clamp(1.0, 600.0) as u64))
            }
        }
    }

    /// Waits until so many bytes of factorizations may live beside the cache; hold the permit until they are dropped.
    ///
    /// Without it every waiting request would factorize first and keep its factor while it queues for its answer. What
    /// exceeds the whole budget takes all of it: it runs alone.
    ///
    /// # Errors
    /// 500 `internal` if the pool is gone.
    pub async fn reserve(&self, n_bytes: usize) -> Result<SemaphorePermit<'_>, Problem> {
        let kib = u32::try_from(n_bytes.div_ceil(1024)).unwrap_or(u32::MAX).min(self.memory_kib);
        self.memory.acquire_many(kib).await.map_err(|_| Problem::internal())
    }

    /// Whether another request would be admitted.
    pub fn has_room(&self) -> bool {
        self.places.available_permits() > 0
    }

    /// Runs a job on the lane for its flops and answers with its result and the time of its stages.
    ///
    /// # Errors
    /// 500 `internal` if the job panicked; the panic is logged and the threads live on.
    pub async fn run<T: Send + 'static>(
        &self,
        flops: f64,
        job: impl FnOnce(&JobObserver) -> T + Send + 'static,
    ) -> Result<(T, StageTimes), Problem> {
        let lane = if flops > EXCLUSIVE_FLOPS { &self.exclusive } else { &self.shared };
        let permit = lane.permits.clone().acquire_owned().await.map_err(|_| Problem::internal())?;
        let (sender, receiver) = oneshot::channel();
        let cancelled = Arc::new(AtomicBool::new(false));
        let _cancel_on_drop = CancelOnDrop(cancelled.clone());
        lane.pool.spawn(move || {
            let observer = JobObserver { cancelled, clock: Mutex::default() };
            let outcome = catch_unwind(AssertUnwindSafe(|| job(&observer)));
            drop(permit);
            // The receiver is gone if the client is.
            let _ = sender.send(outcome.map(|result| (result, observer.times())));
        });
        match receiver.await {
            Ok(Ok(finished)) => Ok(finished),
            Ok(Err(_)) | Err(_) => {
                tracing::error!("a compute job panicked");
                Err(Problem::internal())
            }
        }
    }
}

struct CancelOnDrop(Arc<AtomicBool>);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Time spent in each stage of a job.
#[derive(Debug, Clone, Copy, Default)]
pub struct StageTimes {
    pub gram: Duration,
    pub factor: Duration,
    pub solve: Duration,
    pub evaluate: Duration,
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

/// Watches one job: measures its stages, tells it when its client is gone.
pub struct JobObserver {
    cancelled: Arc<AtomicBool>,
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
    /// The times so far, the current stage included.
    pub fn times(&self) -> StageTimes {
        let mut clock = self.clock.lock().unwrap_or_else(PoisonError::into_inner);
        clock.stop();
        clock.times
    }
}

impl Observer for JobObserver {
    fn enter(&self, stage: Stage) {
        let mut clock = self.clock.lock().unwrap_or_else(PoisonError::into_inner);
        clock.stop();
        clock.current = Some((stage, Instant::now()));
    }

    fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::http::slug::Slug;

    #[tokio::test]
    async fn a_full_queue_is_refused_until_a_place_is_free() {
        let compute = Compute::new(1, 1, 1 << 20).unwrap();
        let first = compute.admit().unwrap();
        let _second = compute.admit().unwrap();
        assert!(!compute.has_room());
        assert_eq!(compute.admit().err().map(|p| p.slug()), Some(Slug::Overloaded));
        drop(first);
        assert!(compute.admit().is_ok());
    }

    #[tokio::test]
    async fn a_panic_is_one_internal_error_and_the_pool_lives() {
        let compute = Compute::new(1, 1, 1 << 20).unwrap();
        let outcome = compute
            .run(0.0, |_| {
                if true {
                    panic!("a bug")
                }
            })
            .await;
        assert_eq!(outcome.err().map(|p| p.slug()), Some(Slug::Internal));
        assert_eq!(compute.run(0.0, |_| 5).await.map(|found| found.0).ok(), Some(5));
    }

    #[tokio::test]
    async fn dropping_the_future_cancels_the_job() {
        let compute = Compute::new(1, 1, 1 << 20).unwrap();
        let (began, has_begun) = oneshot::channel();
        let (stopped, has_stopped) = oneshot::channel();
        let mut job = Box::pin(compute.run(1e12, move |observer| {
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
    async fn what_exceeds_the_memory_runs_alone() {
        let compute = Compute::new(1, 8, 1 << 20).unwrap();
        let small = compute.reserve(1 << 10).await.unwrap();
        let mut large = Box::pin(compute.reserve(1 << 40));
        assert!(futures_util::poll!(&mut large).is_pending());
        drop(small);
        assert!(large.await.is_ok());
    }

    #[tokio::test]
    async fn small_jobs_run_beside_a_large_one() {
        let compute = Compute::new(1, 8, 1 << 20).unwrap();
        let (release, released) = std::sync::mpsc::channel::<()>();
        let mut large = Box::pin(compute.run(1e12, move |_| released.recv().is_ok()));
        assert!(futures_util::poll!(&mut large).is_pending());
        assert_eq!(compute.run(1.0, |_| 3).await.map(|found| found.0).ok(), Some(3));
        release.send(()).unwrap();
        assert_eq!(large.await.map(|found| found.0).ok(), Some(true));
    }
}
