//! The host: shared state of all requests, independent of what they compute.

use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use tokio_util::sync::CancellationToken;

use super::jobs::{JobLimits, Jobs};
use super::metrics::Metrics;
use super::settings::Settings;
use crate::access::Keys;
use crate::compute::Compute;
use crate::memory::budget::{BeyondBudget, Budget};
use crate::problem::slug::Slug;
use crate::problem::{Problem, catalogue};
use crate::store::Objects;
use crate::wire::read::limits::{Lists, ParseContext};
use crate::wire::read::renamed::RenamedWord;
use gramian_observer::Observer;

/// Reason why the host does not start.
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

/// Bytes of memory of each purpose of the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shares {
    /// Bodies that are read and unpacked, and requests that wait.
    pub intake: usize,
    /// Limit of one body, and of its unpacked form.
    pub body: usize,
    /// Jobs and their results, if there is no store.
    pub jobs: usize,
    /// Work and answers, and whatever results the service keeps.
    pub work: usize,
}

/// The parts of a host that depend on the service over it.
pub struct Guest {
    pub shares: Shares,
    /// Limits of the lists of its requests.
    pub lists: Lists,
    /// Words of its requests that have another name now.
    pub renamed: &'static [RenamedWord],
    /// Types of problems that it answers with, those of the host included.
    pub problems: Vec<Slug>,
    /// Header with the id of what a request is about, if the service has such ids. Proxies route by it.
    pub subject: Option<Subject>,
}

/// Ids of what requests are about, in a header and in paths.
#[derive(Debug, Clone)]
pub struct Subject {
    pub header: axum::http::HeaderName,
    /// Start of the paths that end in an id.
    pub path: &'static str,
    /// Whether a text is an id.
    pub is_id: fn(&str) -> bool,
}

/// Settings, keys, memory, threads and jobs.
pub struct Host {
    pub settings: Settings,
    pub guest: Guest,
    pub keys: Arc<Keys>,
    pub metrics: Metrics,
    /// Memory for bodies that are read, decompressed and parsed, and for requests that wait.
    pub intake: Budget,
    /// Memory for work and answers.
    pub work: Budget,
    pub jobs: Jobs,
    pub compute: Arc<Compute>,
    /// Number of requests that have arrived but are not answered.
    pub n_requests: AtomicUsize,
    /// Cancelled when the server drains. It then finishes its requests, but is not ready for more.
    pub draining: CancellationToken,
}

impl Host {
    /// Starts the compute threads. Jobs are in the store, or in memory if there is none.
    ///
    /// # Errors
    /// Fails if a file of keys is wrong, or the operating system refuses the threads.
    pub fn new(
        settings: Settings,
        guest: Guest,
        store: Option<Arc<Objects>>,
    ) -> Result<Arc<Self>, StartError> {
        let keys = Keys::new(&settings.api_keys, settings.keys_file.as_deref()).map_err(StartError::Keys)?;
        let (n_owners, n_threads, max_queue) =
            (settings.n_owners(), settings.n_threads(), settings.max_queue);
        let of_jobs = JobLimits {
            n_bytes: if store.is_some() { settings.store_job_bytes } else { guest.shares.jobs },
            max_kept: settings.max_jobs,
            n_owners,
            n_threads,
            max_queue,
            max_followers: settings.max_connections / 2,
        };
        Ok(Arc::new(Self {
            jobs: Jobs::new(store, &of_jobs),
            intake: Budget::new(guest.shares.intake, n_owners),
            work: Budget::new(guest.shares.work, n_owners),
            compute: Arc::new(Compute::new(n_threads, max_queue, n_owners, settings.deadline())?),
            keys: Arc::new(keys),
            metrics: Metrics::new(&guest.problems)?,
            n_requests: AtomicUsize::new(0),
            draining: CancellationToken::new(),
            guest,
            settings,
        }))
    }

    /// Limits and observer for parsing a body.
    pub fn context<'a>(&'a self, observer: &'a dyn Observer) -> ParseContext<'a> {
        ParseContext { lists: &self.guest.lists, renamed: self.guest.renamed, observer }
    }

    /// 413 for work that takes more memory than there is for `owner`.
    pub fn beyond_memory(BeyondBudget { limit }: BeyondBudget, n_bytes: usize, remedy: &str) -> Problem {
        Problem::too_large(catalogue::PROBLEM_TOO_LARGE, "bytes of memory", limit, Some(n_bytes))
            .with_remedy(remedy)
    }
}
