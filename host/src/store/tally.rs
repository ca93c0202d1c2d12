//! Counts of calls to the store and of their failures.

use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};

/// A kind of call to the store.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verb {
    Read,
    Write,
    List,
    Delete,
    /// Asks whether an object exists.
    Find,
}

impl Verb {
    pub const ALL: [Self; 5] = [Self::Read, Self::Write, Self::List, Self::Delete, Self::Find];

    pub fn name(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Write => "write",
            Self::List => "list",
            Self::Delete => "delete",
            Self::Find => "find",
        }
    }
}

impl fmt::Display for Verb {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Counts of calls since the start, by verb: answered, failed.
#[derive(Default)]
pub struct Tally([[AtomicU64; 2]; Verb::ALL.len()]);

impl Tally {
    /// Counts a call.
    pub fn add(&self, verb: Verb, is_answered: bool) {
        self.0[verb as usize][usize::from(!is_answered)].fetch_add(1, Ordering::Relaxed);
    }

    /// Returns how often the store answered a verb, and how often it failed.
    pub fn of(&self, verb: Verb) -> [u64; 2] {
        self.0[verb as usize].each_ref().map(|count| count.load(Ordering::Relaxed))
    }
}
