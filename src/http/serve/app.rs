//! What every request shares.

use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use tokio_util::sync::CancellationToken;

use super::keys::Keys;
use super::plan::FitFailure;
use crate::config::Config;
use crate::http::compute::Compute;
use crate::http::problem::Problem;
use crate::memory::Memory;
use crate::store::budget::Budget;
use crate::store::clouds::CloudStore;
use crate::store::learned::LearnedStore;
use crate::store::prepared::{PreparedBytes, PreparedStore};

/// Configuration, stores and compute pool.
pub struct App {
    pub config: Config,
    pub memory: Memory,
    pub keys: Keys,
    /// The memory of bodies that are read, unpacked and parsed, and of requests that wait.
    pub intake: Budget,
    pub clouds: CloudStore<Problem>,
    pub prepared: PreparedStore<FitFailure>,
    pub learned: LearnedStore<Problem>,
    pub compute: Arc<Compute>,
    /// Requests between their arrival and their answer.
    pub n_requests: AtomicUsize,
    /// Cancelled when the server drains: it still answers, but is not ready for more.
    pub draining: CancellationToken,
}

impl App {
    /// Starts the compute threads and empty stores.
    ///
    /// # Errors
    /// If the operating system refuses the threads.
    pub fn new(config: Config) -> Result<Arc<Self>, rayon::ThreadPoolBuildError> {
        let (memory, keys) = (Memory::of(&config), Keys::new(&config.api_keys));
        let n_owners = keys.n_owners();
        let of_prepared =
            PreparedBytes { kept: memory.cache, spare: memory.spare, budget: memory.work, n_owners };
        Ok(Arc::new(Self {
            intake: Budget::new(memory.intake, n_owners),
            clouds: CloudStore::new(memory.clouds),
            prepared: PreparedStore::new(of_prepared),
            learned: LearnedStore::default(),
            compute: Arc::new(Compute::new(
                config.n_threads(),
                config.max_queue,
                n_owners,
                config.deadline(),
            )?),
            memory,
            keys,
            n_requests: AtomicUsize::new(0),
            draining: CancellationToken::new(),
            config,
        }))
    }
}
