//! The application: everything that requests share.

use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use tokio_util::sync::CancellationToken;

use super::durable::Durable;
use super::jobs::{JobLimits, Jobs};
use crate::config::Config;
use crate::http::access::Keys;
use crate::http::compute::Compute;
use crate::http::metrics::Metrics;
use crate::http::problem::Problem;
use crate::http::problem::slug::Slug;
use crate::memory::Memory;
use crate::store::Owner;
use crate::store::budget::{BeyondBudget, Budget, Reservation};
use crate::store::clouds::CloudStore;
use crate::store::learned::LearnedStore;
use crate::store::prepared::{PreparedBytes, PreparedStore};
use gramian_numerics::error::NumericsError;

/// Reason why the service does not start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    #[error("the store (GRAMIAN_STORE) {0}")]
    Store(String),
    #[error("the keys (GRAMIAN_KEYS_FILE): {0}")]
    Keys(String),
    #[error("the metrics cannot be named: {0}")]
    Metrics(#[from] prometheus::Error),
    #[error("the threads cannot be started: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Reason why there is no factorization.
///
/// Requests that share a computation share its failure, but each adds its own pointers.
#[derive(Debug, Clone)]
pub enum FitFailure {
    Refused(NumericsError),
    Broken(Problem),
    /// Cholesky failed, and there was not enough memory for the fallback at that moment.
    NeedsAll,
}

/// Configuration, stores and compute pool.
pub struct App {
    pub config: Config,
    pub memory: Memory,
    pub keys: Arc<Keys>,
    pub metrics: Metrics,
    /// Memory for bodies that are read, decompressed and parsed, and for requests that wait.
    pub intake: Budget,
    pub clouds: CloudStore<Problem>,
    /// The store in which clouds outlive the process, if one is configured.
    pub durable: Option<Durable>,
    pub jobs: Jobs,
    pub prepared: PreparedStore<FitFailure>,
    pub learned: LearnedStore<Problem>,
    pub compute: Arc<Compute>,
    /// Number of requests that have arrived but are not answered.
    pub n_requests: AtomicUsize,
    /// Cancelled when the server drains. It then finishes its requests, but is not ready for more.
    pub draining: CancellationToken,
}

impl App {
    /// Opens the store, and starts the compute threads. All caches are empty.
    ///
    /// # Errors
    /// Fails if the store does not work, or the operating system refuses the threads.
    pub async fn new(config: Config) -> Result<Arc<Self>, StartError> {
        let durable = match &config.store {
            None => None,
            Some(place) => Some(Durable::open(place).await.map_err(StartError::Store)?),
        };
        let keys = Keys::new(&config).map_err(StartError::Keys)?;
        let (memory, n_owners) = (Memory::of(&config), config.n_owners());
        let of_prepared =
            PreparedBytes { kept: memory.cache, spare: memory.spare, budget: memory.work, n_owners };
        let in_store = durable.as_ref().map(|durable| durable.objects.clone());
        let (n_threads, max_queue) = (config.n_threads(), config.max_queue);
        let of_jobs = JobLimits {
            n_bytes: if in_store.is_some() { config.store_job_bytes } else { memory.jobs },
            max_kept: config.max_jobs,
            n_owners,
            n_threads,
            max_queue,
            max_followers: config.max_connections / 2,
        };
        Ok(Arc::new(Self {
            jobs: Jobs::new(in_store, &of_jobs),
            intake: Budget::new(memory.intake, n_owners),
            clouds: CloudStore::new(memory.clouds),
            durable,
            prepared: PreparedStore::new(of_prepared),
            learned: LearnedStore::default(),
            compute: Arc::new(Compute::new(n_threads, max_queue, n_owners, config.deadline())?),
            memory,
            keys: Arc::new(keys),
            metrics: Metrics::new()?,
            n_requests: AtomicUsize::new(0),
            draining: CancellationToken::new(),
            config,
        }))
    }

    /// Reserves memory for work, once enough is free. `None` if the memory is no longer wanted.
    ///
    /// To avoid deadlocks, the caller must hold no other memory for work while it waits.
    ///
    /// # Errors
    /// 413 `problem-too-large` if the budget will never have that much.
    pub async fn reserve(
        &self,
        owner: Owner,
        n_bytes: usize,
        is_wanted: impl Fn() -> bool,
    ) -> Result<Option<Reservation>, Problem> {
        let beyond = |BeyondBudget { limit }| {
            let remedy = "take fewer points or queries, regularize what is singular to rounding by a larger alpha, \
                          or raise GRAMIAN_MEMORY_BYTES";
            Problem::too_large(Slug::ProblemTooLarge, "bytes of memory", limit, Some(n_bytes))
                .with_remedy(remedy)
        };
        self.prepared.reserve(owner, n_bytes, is_wanted).await.map_err(beyond)
    }
}
