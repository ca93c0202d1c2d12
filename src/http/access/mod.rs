//! Who may ask, as whom, and how much: bearer keys from the configuration and from a file.
//!
//! KEYS are kept as BLAKE3 hashes, never in plain. Theirs are random (`gramian key` makes them), so that a fast hash is enough. Which
//! key it is takes the same time to find for all of them, and for none.
//!
//! VIEWS. What a key registers is seen through its view alone. Keys of one name have one view, and so may keys of several names: a key is
//! replaced by adding its successor to the same view and taking it out later, with the clouds where they were.
//!
//! ROTATION. The file is read again when it changes. One that cannot be read, or not understood, changes nothing, and is reported; one
//! without keys lets nobody in.

mod file;
mod limits;

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use arc_swap::ArcSwap;
use subtle::{Choice, ConditionallySelectable, ConstantTimeEq};

use crate::config::Config;
use crate::store::Owner;
use crate::store::objects::OwnerName;
pub use file::generate;
use file::{KeyEntry, KeysFile};
use limits::Limits;
pub use limits::{Entered, TooMany};

/// Reads the text of a file of keys: how many there are.
///
/// # Errors
/// Says what is wrong with it.
pub fn check_file(text: &str) -> Result<usize, String> {
    KeysFile::parse(text).map(|file| file.keys.len())
}

/// How often it is looked whether the file has changed.
const LOOKING: Duration = Duration::from_secs(1);

/// BLAKE3 of a key, or of the file of keys.
type Digest = [u8; 32];

/// All keys, as they are now.
pub struct Keys {
    configured: Vec<Digest>,
    file: Option<PathBuf>,
    /// Of the text of the file that was read at the start.
    first: Digest,
    callers: ArcSwap<Vec<Arc<Caller>>>,
    /// Views by the number of their owner: numbers are never given again.
    views: Mutex<Vec<OwnerName>>,
}

/// A key: who has it, and what that may do.
pub struct Caller {
    digest: Digest,
    /// For logs; nothing for keys of the configuration.
    pub name: Option<String>,
    pub owner: Owner,
    limits: Limits,
}

impl Caller {
    /// Lets a request in, which is under way until what is returned is dropped.
    ///
    /// # Errors
    /// [`TooMany`]: beyond the rate or the number of requests of this key.
    pub fn enter(&self) -> Result<Entered, TooMany> {
        self.limits.enter()
    }
}

impl Keys {
    /// # Errors
    /// Says what is wrong with the file.
    pub fn new(config: &Config) -> Result<Self, String> {
        let digest = |key: &String| blake3::hash(key.trim().as_bytes()).into();
        // A blank key, which the configuration refuses, is nobody's.
        let configured = config.api_keys.iter().filter(|key| !key.trim().is_empty()).map(digest).collect();
        let (file, first) = match &config.keys_file {
            Some(path) if !config.is_open() => read_file(path)?,
            _ => Default::default(),
        };
        let keys = Self {
            configured,
            file: config.keys_file.clone(),
            first,
            callers: ArcSwap::default(),
            views: Mutex::default(),
        };
        if config.is_open() {
            keys.owner(OwnerName("everyone".to_owned()));
            return Ok(keys);
        }
        keys.put(&file);
        Ok(keys)
    }

    /// Whether anyone may call.
    pub fn is_open(&self) -> bool {
        self.configured.is_empty() && self.file.is_none()
    }

    /// All whom there are, or were since the start.
    pub fn owners(&self) -> Vec<Owner> {
        (0..self.views().len()).map(Owner).collect()
    }

    /// Whose view has this name, if anybody's.
    pub fn owner_named(&self, name: &OwnerName) -> Option<Owner> {
        self.views().iter().position(|view| view == name).map(Owner)
    }

    /// The name of an owner's view, whatever the order of the keys. It does not tell a key.
    pub fn name_of(&self, owner: Owner) -> OwnerName {
        self.views().get(owner.0).cloned().unwrap_or_else(|| OwnerName("nobody".to_owned()))
    }

    /// Finds a key in time that does not depend on the keys: hashes are compared in full, and all of them.
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

    /// Takes the keys of the file again whenever it has others, for as long as the process lives. It is read each time: neither its
    /// time nor its length tells that it is as it was, nor that it cannot be read now.
    pub async fn follow_file(self: Arc<Self>) {
        let Some(path) = &self.file else { return };
        let mut last = Ok(self.first);
        let mut ticks = tokio::time::interval(LOOKING);
        loop {
            ticks.tick().await;
            let found = read_file(path);
            let now = found.as_ref().map(|(_, digest)| *digest).map_err(String::clone);
            if now == last {
                continue;
            }
            last = now;
            match found {
                Ok((file, _)) => {
                    self.put(&file);
                    tracing::info!(n_keys = self.callers.load().len(), "keys were read again");
                }
                Err(error) => {
                    tracing::error!(error, "keys stay as they were: their file (GRAMIAN_KEYS_FILE)")
                }
            }
        }
    }

    /// Takes these keys in place of those before. Whose limits are as they were goes on counting.
    fn put(&self, file: &KeysFile) {
        let before = self.callers.load_full();
        let before: HashMap<Digest, &Arc<Caller>> =
            before.iter().map(|caller| (caller.digest, caller)).collect();
        let configured = self.configured.iter().map(|&digest| Caller {
            digest,
            name: None,
            owner: self.owner(view_of_digest(&digest)),
            limits: Limits::default(),
        });
        let named = file.keys.iter().map(|entry| self.caller(entry));
        let kept = |caller: Caller| match before.get(&caller.digest) {
            Some(same) if same.is_as(&caller) => (*same).clone(),
            _ => Arc::new(caller),
        };
        self.callers.store(Arc::new(configured.chain(named).map(kept).collect()));
    }

    fn caller(&self, entry: &KeyEntry) -> Caller {
        Caller {
            digest: entry.digest,
            name: Some(entry.name.clone()),
            owner: self.owner(OwnerName(format!("view-{}", entry.view()))),
            limits: Limits::new(entry.rule),
        }
    }

    fn owner(&self, name: OwnerName) -> Owner {
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

impl Caller {
    fn is_as(&self, other: &Self) -> bool {
        self.name == other.name && self.owner == other.owner && self.limits.rule == other.limits.rule
    }
}

/// The keys of a file, and the digest of its text.
fn read_file(path: &Path) -> Result<(KeysFile, Digest), String> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("cannot be read: {error}"))?;
    Ok((KeysFile::parse(&text)?, blake3::hash(text.as_bytes()).into()))
}

/// Each key of the configuration has a view of its own.
fn view_of_digest(digest: &Digest) -> OwnerName {
    let name = blake3::Hash::from(blake3::derive_key("gramian 2026 owner of clouds", digest)).to_hex();
    OwnerName(name[..32].to_owned())
}

#[cfg(test)]
mod tests;
