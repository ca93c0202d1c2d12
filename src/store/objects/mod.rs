//! What outlives the process: clouds as objects in a directory or in object storage.
//!
//! NAMES. `<owner>/clouds/<cloud id>` is a cloud. The names and times of these objects are the list of
//! clouds: see clouds.rs.
//!
//! WRITES are whole or not at all: a file is written beside its name, flushed and then renamed; a bucket has an object when all of it has come. A
//! cloud is written once: whoever comes second finds it.
//!
//! LEFT-OVERS of processes that were killed while they wrote a file, of deleted clouds and of jobs go by themselves: see retention.rs.
//!
//! FACTORS are under `<owner>/factors/`, see factors.rs, and go with their clouds.
//!
//! JOBS are under `<owner>/jobs/`, `<owner>/open/` and `<owner>/claims/`: see jobs/.
//!
//! READS are of what was written, or of nothing: see cloud_object.rs. What is damaged is put aside, under `damaged/`, and reported; it is not there
//! any more then, and can be posted again.
//!
//! WHAT GOES. Clouds beyond an age or a number of bytes: see retention.rs.

pub mod cloud_object;
mod clouds;
pub mod factors;
pub mod jobs;
mod patience;
pub mod pieces;
mod place;
mod retention;
pub mod room;
mod tally;
#[cfg(test)]
mod tests;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use object_store::path::Path;
use object_store::{Error, ObjectStore, ObjectStoreExt, PutMode, PutOptions, PutPayload};
use uuid::Uuid;

use super::key::CloudId;
pub use clouds::{ListWindow, Listed, Written};
use patience::Patient;
pub use place::Place;
pub use retention::{Retention, Swept};
pub use tally::{Tally, Verb};

/// Why an object is not what was written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Damaged(pub &'static str);

/// Why the store does not answer.
#[derive(Debug, Clone, thiserror::Error)]
#[error("the store failed to {verb} {name}: {reason}")]
pub struct Unavailable {
    verb: Verb,
    name: String,
    reason: String,
}

/// How long a store may take to say whether it works, at the start.
const PATIENCE: Duration = Duration::from_secs(20);

/// The store behind all memory.
pub struct Objects {
    store: Arc<dyn ObjectStore>,
    root: Path,
    /// Where files are, if it is a directory.
    directory: Option<PathBuf>,
    /// Whether objects are kept in the memory of this process.
    in_memory: bool,
    tally: Tally,
    n_damaged: AtomicU64,
}

/// Whose objects are meant, by a name that outlives the order of keys in a configuration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OwnerName(pub String);

impl Objects {
    /// Opens a place, and sees that it can be written to and read.
    ///
    /// # Errors
    /// Says what is wrong with it.
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
        match tokio::time::timeout(PATIENCE, probe).await {
            Ok(Ok(())) => Ok(objects),
            Ok(Err(error)) => Err(format!("does not work: {error}")),
            Err(_) => Err(format!("does not answer within {} s", PATIENCE.as_secs())),
        }
    }

    /// A store in memory, as large as memory.
    pub fn in_memory() -> Self {
        let memory = Arc::new(object_store::memory::InMemory::new());
        Self { in_memory: true, ..Self::over(memory, Path::default()) }
    }

    /// A store of any kind, with what stands before all names.
    pub fn over(store: Arc<dyn ObjectStore>, root: Path) -> Self {
        let store = Arc::new(Patient::new(store));
        let (tally, n_damaged) = (Tally::default(), AtomicU64::new(0));
        Self { store, root, directory: None, in_memory: false, tally, n_damaged }
    }

    /// Whether objects are kept in the memory of this process alone.
    pub fn in_memory_alone(&self) -> bool {
        self.in_memory
    }

    /// What was asked of the store since the start.
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// Objects that were not what was written.
    pub fn n_damaged(&self) -> u64 {
        self.n_damaged.load(Ordering::Relaxed)
    }

    /// Counts an object that is not what was written.
    fn report(&self, name: &Path, damaged: Damaged) {
        self.n_damaged.fetch_add(1, Ordering::Relaxed);
        tracing::error!(object = %name, reason = damaged.0, "an object is damaged");
    }

    /// Says whether it was there, as far as the store tells: buckets do not.
    async fn delete(&self, name: &Path) -> Result<bool, Unavailable> {
        Ok(self.counted(Verb::Delete, name, self.store.delete(name).await)?.is_some())
    }

    async fn put(&self, name: &Path, payload: PutPayload) -> Result<(), Unavailable> {
        let written = self.store.put(name, payload).await;
        written
            .map(|_| self.tally.add(Verb::Write, true))
            .map_err(|error| self.failed(Verb::Write, name, error))
    }

    /// Writes an object that is not there; says whether it was not.
    async fn create(&self, name: &Path, payload: PutPayload) -> Result<bool, Unavailable> {
        match self.store.put_opts(name, payload, PutOptions::from(PutMode::Create)).await {
            Ok(_) => {
                self.tally.add(Verb::Write, true);
                Ok(true)
            }
            Err(Error::AlreadyExists { .. }) => Ok(false),
            Err(error) => Err(self.failed(Verb::Write, name, error)),
        }
    }

    /// What the store answered, nothing where there is no such object.
    fn counted<T>(
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

    fn failed(&self, verb: Verb, name: &Path, error: Error) -> Unavailable {
        self.tally.add(verb, false);
        Unavailable { verb, name: name.to_string(), reason: error.to_string() }
    }

    fn path(&self, parts: &[&str]) -> Path {
        self.root.parts().chain(parts.iter().map(|&part| part.into())).collect()
    }
}
