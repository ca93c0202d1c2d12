//! What every request shares.

use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use tokio_util::sync::CancellationToken;

use crate::config::Config;
use crate::http::auth::Keys;
use crate::http::compute::Compute;
use crate::http::operation::FactorFailure;
use crate::store::clouds::CloudStore;
use crate::store::factors::FactorStore;

/// Configuration, stores and compute pool.
pub struct App {
    pub config: Config,
    pub keys: Keys,
    pub clouds: CloudStore,
    pub factors: FactorStore<FactorFailure>,
    pub compute: Compute,
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
        Ok(Arc::new(Self {
            keys: Keys::new(&config.api_keys),
            clouds: CloudStore::new(config.cloud_bytes),
            factors: FactorStore::new(config.cache_bytes),
            compute: Compute::new(config.n_threads(), config.max_queue, config.cache_bytes)?,
            n_requests: AtomicUsize::new(0),
            draining: CancellationToken::new(),
            config,
        }))
    }
}
