//! Objects that outlive the process, in a directory or in object storage.
//!
//! NAMES. Everything of an owner is under `<owner>/`. JOBS are under `<owner>/jobs/`, `<owner>/open/` and
//! `<owner>/claims/` (jobs/). Other folders belong to the service.
//!
//! WRITES are atomic. A file is written under a temporary name, flushed and renamed. A bucket shows an object
//! when all of it has arrived.
//!
//! SWEEPS. Left-overs of processes killed while writing a file are deleted (sweep.rs), and left-overs of jobs
//! and claims in jobs/.

pub mod changes;
pub mod jobs;
pub mod pieces;
mod place;
pub mod room;
mod sweep;
mod tally;
#[cfg(test)]
pub mod testing;
mod timeouts;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use object_store::path::Path;
use object_store::{Error, ObjectStore, ObjectStoreExt, PutMode, PutOptions, PutPayload};
use uuid::Uuid;

pub use place::Place;
pub use sweep::AT_WORK;
pub use tally::{Tally, Verb};
use timeouts::WithTimeouts;

/// Reason why an object is not what was written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct DamagedObject(pub &'static str);

/// A failed call to the store.
#[derive(Debug, Clone, thiserror::Error)]
#[error("the store failed to {verb} {name}: {reason}")]
pub struct Unavailable {
    verb: Verb,
    name: String,
    reason: String,
}

/// Time in which a store must show at the start that it works.
const PROBE_TIMEOUT: Duration = Duration::from_secs(20);

/// The store behind all caches in memory.
pub struct Objects {
    store: Arc<dyn ObjectStore>,
    root: Path,
    /// Directory of the files, if the store is a directory.
    directory: Option<PathBuf>,
    /// Whether objects are kept in the memory of this process.
    in_memory: bool,
    tally: Tally,
    n_damaged: AtomicU64,
}

/// Name of an owner of objects. It does not depend on the order of keys in a configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OwnerName(pub String);

impl Objects {
    /// Opens a place, and checks that it can be written to and read.
    ///
    /// # Errors
    /// Returns what is wrong with the place.
    pub async fn open(
        place: &Place,
        variables: impl IntoIterator<Item = (String, String)>,
    ) -> Result<Self, String> {
        let (store, root) = place.open(variables)?;
        let directory = match place {
            Place::Directory(directory) => Some(directory.clone()),
            Place::Bucket(_) => None,
        };
        let objects = Self { directory, ..Self::over(store, root) };
        let name = objects.path(&["probe", &Uuid::now_v7().to_string()]);
        let probe = async {
            objects.store.put(&name, PutPayload::from_static(b"probe")).await?;
            objects.store.get(&name).await?.bytes().await?;
            objects.store.delete(&name).await
        };
        match tokio::time::timeout(PROBE_TIMEOUT, probe).await {
            Ok(Ok(())) => Ok(objects),
            Ok(Err(error)) => Err(format!("does not work: {error}")),
            Err(_) => Err(format!("does not answer within {} s", PROBE_TIMEOUT.as_secs())),
        }
    }

    /// Creates a store in memory, limited only by memory.
    pub fn in_memory() -> Self {
        let memory = Arc::new(object_store::memory::InMemory::new());
        Self { in_memory: true, ..Self::over(memory, Path::default()) }
    }

    /// Creates a store over any backend, with the prefix of all names.
    pub fn over(store: Arc<dyn ObjectStore>, root: Path) -> Self {
        let store = Arc::new(WithTimeouts::new(store));
        let (tally, n_damaged) = (Tally::default(), AtomicU64::new(0));
        Self { store, root, directory: None, in_memory: false, tally, n_damaged }
    }

    /// Returns whether objects are kept in the memory of this process alone.
    pub fn in_memory_alone(&self) -> bool {
        self.in_memory
    }

    /// The store itself, for calls that are counted by [`Objects::counted`].
    pub fn backend(&self) -> &dyn ObjectStore {
        &*self.store
    }

    /// Counts of calls to the store since the start.
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// Number of damaged objects found since the start.
    pub fn n_damaged(&self) -> u64 {
        self.n_damaged.load(Ordering::Relaxed)
    }

    /// Counts a damaged object.
    pub fn count_damaged(&self) {
        self.n_damaged.fetch_add(1, Ordering::Relaxed);
    }

    /// Counts and logs a damaged object.
    pub fn report(&self, name: &Path, damaged: DamagedObject) {
        self.count_damaged();
        tracing::error!(object = %name, reason = damaged.0, "an object is damaged");
    }

    /// Deletes an object. Returns whether it existed, as far as the store tells: buckets do not.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn delete(&self, name: &Path) -> Result<bool, Unavailable> {
        Ok(self.counted(Verb::Delete, name, self.store.delete(name).await)?.is_some())
    }

    /// Writes an object, whether or not it exists.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn put(&self, name: &Path, payload: PutPayload) -> Result<(), Unavailable> {
        let written = self.store.put(name, payload).await;
        written
            .map(|_| self.tally.add(Verb::Write, true))
            .map_err(|error| self.failed(Verb::Write, name, error))
    }

    /// Writes an object unless it exists. Returns whether it was written.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub async fn create(&self, name: &Path, payload: PutPayload) -> Result<bool, Unavailable> {
        match self.store.put_opts(name, payload, PutOptions::from(PutMode::Create)).await {
            Ok(_) => {
                self.tally.add(Verb::Write, true);
                Ok(true)
            }
            Err(Error::AlreadyExists { .. }) => Ok(false),
            Err(error) => Err(self.failed(Verb::Write, name, error)),
        }
    }

    /// Counts an answer of the store. A missing object becomes `None`.
    ///
    /// # Errors
    /// [`Unavailable`].
    pub fn counted<T>(
        &self,
        verb: Verb,
        name: &Path,
        answer: Result<T, Error>,
    ) -> Result<Option<T>, Unavailable> {
        let found = match answer {
            Ok(found) => Some(found),
            Err(Error::NotFound { .. }) => None,
            Err(error) => return Err(self.failed(verb, name, error)),
        };
        self.tally.add(verb, true);
        Ok(found)
    }

    /// Counts a failed call to the store.
    pub fn failed(&self, verb: Verb, name: &Path, error: Error) -> Unavailable {
        self.tally.add(verb, false);
        Unavailable { verb, name: name.to_string(), reason: error.to_string() }
    }

    /// The path of an object or a folder.
    pub fn path(&self, parts: &[&str]) -> Path {
        self.root.parts().chain(parts.iter().map(|&part| part.into())).collect()
    }
}
