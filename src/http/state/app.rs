//! The application: the host, and what requests about clouds share on it.

use std::ops::Deref;
use std::sync::Arc;

use prometheus::IntCounterVec;

use super::durable::Durable;
use crate::config::Config;
use crate::http::fields::limits::Limits;
use crate::http::problem::{self, Problem};
use crate::http::renamed;
use crate::memory::Memory;
use crate::store::clouds::CloudStore;
use crate::store::key::CloudId;
use crate::store::learned::LearnedStore;
use crate::store::prepared::{PreparedBytes, PreparedStore, labels};
use axum::http::HeaderName;
use gramian_host::memory::Owner;
use gramian_host::memory::budget::Reservation;
use gramian_host::state::host::{Guest, Host, StartError, Subject};
use gramian_numerics::error::NumericsError;
use gramian_numerics::model::kind::ModelKind;
use strum::VariantArray;

/// Header with the id of the cloud that a request is about. Proxies route all requests about one cloud to one
/// replica.
pub const CLOUD_HEADER: HeaderName = HeaderName::from_static("gramian-cloud");

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

/// The host, with the stores of clouds and of what was computed from them.
pub struct App {
    pub host: Arc<Host>,
    pub config: Config,
    pub memory: Memory,
    pub clouds: CloudStore<Problem>,
    /// The store in which clouds outlive the process, if one is configured.
    pub durable: Option<Durable>,
    pub prepared: PreparedStore<FitFailure>,
    pub learned: LearnedStore<Problem>,
    /// Solvers that were made ready, by kind.
    pub solvers: IntCounterVec,
}

impl Deref for App {
    type Target = Host;

    fn deref(&self) -> &Host {
        &self.host
    }
}

impl App {
    /// Opens the store, and starts the compute threads. All caches are empty.
    ///
    /// # Errors
    /// Fails if the store does not work, or the operating system refuses the threads.
    pub async fn new(config: Config) -> Result<Arc<Self>, StartError> {
        let durable = match &config.host.store {
            None => None,
            Some(place) => Some(Durable::open(place).await.map_err(StartError::Store)?),
        };
        let memory = Memory::of(&config);
        let guest = Guest {
            shares: memory.shares,
            lists: Limits::of(&config).lists(),
            renamed: &renamed::WORDS,
            problems: problem::all(),
            subject: Some(Subject {
                header: CLOUD_HEADER,
                path: "/v1/clouds/",
                is_id: |text| CloudId::parse(text).is_some(),
            }),
        };
        let in_store = durable.as_ref().map(|durable| durable.objects.0.clone());
        let host = Host::new(config.host.clone(), guest, in_store)?;
        let solvers = host.metrics.counters(
            "gramian_solvers_prepared_total",
            "Solvers prepared, by kind and by what they serve",
            &["kind", "of"],
        )?;
        for kind in ModelKind::VARIANTS.iter().copied().map(Some).chain([None]) {
            solvers.with_label_values(&labels(kind));
        }
        let of_prepared = PreparedBytes { kept: memory.cache, spare: memory.spare };
        Ok(Arc::new(Self {
            clouds: CloudStore::new(memory.clouds),
            durable,
            prepared: PreparedStore::new(of_prepared, host.work.clone()),
            learned: LearnedStore::default(),
            solvers,
            host,
            memory,
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
        let remedy = "take fewer points or queries, regularize what is singular to rounding by a larger alpha, \
                      or raise GRAMIAN_MEMORY_BYTES";
        let reserved = self.prepared.reserve(owner, n_bytes, is_wanted).await;
        reserved.map_err(|beyond| Host::beyond_memory(beyond, n_bytes, remedy))
    }
}
