//! Access control: bearer keys from the configuration and from a file, with their views and limits.
//!
//! KEYS are kept as BLAKE3 hashes, never in plain text. Keys are random (`gramian key` generates them), so a
//! fast hash is enough. Looking up a key takes the same time whichever it is, and also if it is unknown.
//!
//! VIEWS. A cloud is only visible in the view of the key that registered it. Keys of one name share a view,
//! and keys of several names may share one. So a key is replaced by adding its successor to the same view and
//! removing the old key later. The clouds stay where they are.
//!
//! ROTATION. The file is read again when it changes. A file that cannot be read or parsed changes nothing and
//! is reported. Keys of the configuration stay valid. With none there, an empty file lets nobody in.

mod file;
mod limits;

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use arc_swap::ArcSwap;
use subtle::{Choice, ConditionallySelectable, ConstantTimeEq};

use crate::memory::Owner;
use crate::store::OwnerName;
pub use file::generate;
use file::{KeyEntry, KeysFile};
use limits::Limits;
pub use limits::{ConcurrencyPermit, TooMany};

/// Parses the text of a file of keys and returns the number of keys.
///
/// # Errors
/// Tells what is wrong with the text.
pub fn check_file(text: &str) -> Result<usize, String> {
    KeysFile::parse(text).map(|file| file.keys.len())
}

/// Interval between two checks of the file for changes.
const CHECK_INTERVAL: Duration = Duration::from_secs(1);

/// BLAKE3 hash of a key, or of the text of the file of keys.
type Digest = [u8; 32];

/// All current keys.
pub struct Keys {
    configured: Vec<Digest>,
    file: Option<PathBuf>,
    /// Digest of the text of the file that was read at startup.
    digest_at_start: Digest,
    callers: ArcSwap<Vec<Arc<Caller>>>,
    /// Views, indexed by owner. Indices are never reused.
    views: Mutex<Vec<OwnerName>>,
}

/// A key, its owner and its limits.
pub struct Caller {
    digest: Digest,
    /// Name for logs. `None` for keys of the configuration.
    pub name: Option<String>,
    pub owner: Owner,
    limits: Limits,
}

impl Caller {
    /// Admits a request, which counts as in progress until the returned value is dropped.
    ///
    /// # Errors
    /// [`TooMany`] beyond the rate or the concurrency of this key.
    pub fn enter(&self) -> Result<ConcurrencyPermit, TooMany> {
        self.limits.enter()
    }

    fn has_same_settings(&self, other: &Self) -> bool {
        self.name == other.name && self.owner == other.owner && self.limits.rule == other.limits.rule
    }
}

impl Keys {
    /// Reads the keys of the configuration and of the file. Without any of them, anyone may call.
    ///
    /// # Errors
    /// Tells what is wrong with the file.
    pub fn new(api_keys: &[String], keys_file: Option<&Path>) -> Result<Self, String> {
        let digest = |key: &String| blake3::hash(key.trim().as_bytes()).into();
        let configured = api_keys.iter().map(digest).collect();
        let (file, digest_at_start) = match keys_file {
            Some(path) => read_file(path)?,
            None => Default::default(),
        };
        let keys = Self {
            configured,
            file: keys_file.map(Path::to_owned),
            digest_at_start,
            callers: ArcSwap::default(),
            views: Mutex::default(),
        };
        if keys.is_open() {
            keys.register_view(OwnerName("everyone".to_owned()));
            return Ok(keys);
        }
        keys.replace_keys(&file);
        Ok(keys)
    }

    /// Whether anyone may call without a key.
    pub fn is_open(&self) -> bool {
        self.configured.is_empty() && self.file.is_none()
    }

    /// Number of current keys, of the configuration and of the file.
    pub fn n_keys(&self) -> usize {
        self.callers.load().len()
    }

    /// Returns all owners since the start of the process.
    pub fn owners(&self) -> Vec<Owner> {
        (0..self.views().len()).map(Owner).collect()
    }

    /// Finds the owner of the view with this name.
    pub fn owner_named(&self, name: &OwnerName) -> Option<Owner> {
        self.views().iter().position(|view| view == name).map(Owner)
    }

    /// The name of an owner's view. It does not depend on the order of the keys and does not reveal a key.
    pub fn name_of(&self, owner: Owner) -> OwnerName {
        // "nobody" is only for an owner that this process never registered.
        self.views().get(owner.0).cloned().unwrap_or_else(|| OwnerName("nobody".to_owned()))
    }

    /// Finds a key in constant time: full hashes are compared, and always all of them.
    pub fn caller_of(&self, key: &str) -> Option<Arc<Caller>> {
        let digest: Digest = blake3::hash(key.as_bytes()).into();
        let callers = self.callers.load();
        let (mut found, mut position) = (Choice::from(0), 0u64);
        for (index, caller) in callers.iter().enumerate() {
            let is_equal = caller.digest.ct_eq(&digest);
            position.conditional_assign(&(index as u64), is_equal);
            found |= is_equal;
        }
        bool::from(found).then(|| callers.get(position as usize).cloned()).flatten()
    }

    /// Reloads the keys whenever the file has changed, until the process ends.
    ///
    /// The file is read at every check, because neither its modification time nor its length proves that it
    /// is unchanged and still readable.
    pub async fn follow_file(self: Arc<Self>) {
        let Some(path) = &self.file else { return };
        let mut last = Ok(self.digest_at_start);
        let mut ticks = tokio::time::interval(CHECK_INTERVAL);
        loop {
            ticks.tick().await;
            // Blocks for one small file a second.
            let found = read_file(path);
            // Errors are compared too, so that a lasting one is logged once.
            let now = found.as_ref().map(|(_, digest)| *digest).map_err(String::clone);
            if now == last {
                continue;
            }
            last = now;
            match found {
                Ok((file, _)) => {
                    self.replace_keys(&file);
                    tracing::info!(n_keys = self.n_keys(), "keys were read again");
                }
                Err(error) => tracing::error!(
                    error,
                    "the keys file (GRAMIAN_KEYS_FILE) was not reloaded; the previous keys stay valid"
                ),
            }
        }
    }

    /// Replaces the keys of the file. A key whose name, view and limits are unchanged keeps its counters.
    fn replace_keys(&self, file: &KeysFile) {
        let before = self.callers.load_full();
        let before: HashMap<Digest, &Arc<Caller>> =
            before.iter().map(|caller| (caller.digest, caller)).collect();
        let configured = self.configured.iter().map(|&digest| Caller {
            digest,
            name: None,
            owner: self.register_view(view_of_digest(&digest)),
            limits: Limits::default(),
        });
        let named = file.keys.iter().map(|entry| self.caller(entry));
        let kept = |caller: Caller| match before.get(&caller.digest) {
            Some(same) if same.has_same_settings(&caller) => (*same).clone(),
            _ => Arc::new(caller),
        };
        self.callers.store(Arc::new(configured.chain(named).map(kept).collect()));
    }

    fn caller(&self, entry: &KeyEntry) -> Caller {
        Caller {
            digest: entry.digest,
            name: Some(entry.name.clone()),
            owner: self.register_view(OwnerName(format!("view-{}", entry.view()))),
            limits: Limits::new(entry.rule),
        }
    }

    /// Returns the owner of a view, new if the name is. Indices are never reused.
    fn register_view(&self, name: OwnerName) -> Owner {
        let mut views = self.views();
        let found = views.iter().position(|view| *view == name);
        Owner(found.unwrap_or_else(|| {
            views.push(name);
            views.len() - 1
        }))
    }

    #[expect(clippy::disallowed_methods, reason = "a list of names, for as long as it takes to look into it")]
    fn views(&self) -> MutexGuard<'_, Vec<OwnerName>> {
        self.views.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Reads and parses a file. Also returns the digest of its text.
fn read_file(path: &Path) -> Result<(KeysFile, Digest), String> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("cannot be read: {error}"))?;
    Ok((KeysFile::parse(&text)?, blake3::hash(text.as_bytes()).into()))
}

/// The view of a key from the configuration. Each such key has its own.
fn view_of_digest(digest: &Digest) -> OwnerName {
    let name = blake3::Hash::from(blake3::derive_key("gramian 2026 owner of clouds", digest)).to_hex();
    OwnerName(name[..32].to_owned())
}

#[cfg(test)]
mod tests;
