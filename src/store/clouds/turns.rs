//! Turns: locks that allow one change of a cloud at a time within a process.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use tokio::sync::OwnedMutexGuard;

/// Locks by key. A lock exists for as long as a task holds or awaits it.
///
/// A turn is held across calls of the store. Only async tasks await turns, never threads of the compute pool.
pub(super) struct FairSemaphore<K> {
    locks: Mutex<HashMap<K, Weak<tokio::sync::Mutex<()>>>>,
}

impl<K> Default for FairSemaphore<K> {
    fn default() -> Self {
        Self { locks: Mutex::default() }
    }
}

impl<K: Hash + Eq> FairSemaphore<K> {
    /// Waits for the turn of this key. Waiting tasks get it in order of arrival.
    pub(super) async fn take(&self, key: K) -> OwnedMutexGuard<()> {
        let lock = self.lock_of(key);
        lock.lock_owned().await
    }

    fn lock_of(&self, key: K) -> Arc<tokio::sync::Mutex<()>> {
        let mut locks = self.locks();
        if let Some(lock) = locks.get(&key).and_then(Weak::upgrade) {
            return lock;
        }
        // Entries that nobody holds are swept here, so the map stays as small as the traffic.
        locks.retain(|_, lock| lock.strong_count() > 0);
        let lock = Arc::default();
        locks.insert(key, Arc::downgrade(&lock));
        lock
    }

    #[expect(clippy::disallowed_methods, reason = "a table, for a look-up: turns are awaited outside")]
    fn locks(&self) -> MutexGuard<'_, HashMap<K, Weak<tokio::sync::Mutex<()>>>> {
        self.locks.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use futures_util::poll;

    use super::*;

    #[tokio::test]
    async fn one_key_has_one_turn_at_a_time_and_keeps_nothing_of_it() {
        let turns = FairSemaphore::default();
        let first = turns.take(1).await;
        let mut second = Box::pin(turns.take(1));
        assert!(poll!(&mut second).is_pending());
        drop(turns.take(2).await);
        drop(first);
        drop(second.await);
        drop(turns.take(3).await);
        assert_eq!(turns.locks().len(), 1);
    }
}
