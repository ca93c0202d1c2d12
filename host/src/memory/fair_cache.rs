//! A byte-bounded LRU cache shared by owners. When it is full, the owner holding most bytes loses its least
//! recently used entry.
//!
//! An owner with at most an equal share of the bytes loses nothing to others. For whenever the cache is over
//! its bound, some owner holds more than an equal share. An owner may use all bytes that nobody else needs.
//!
//! The cache is not a concurrent map. Its lock is held for table look-ups only, never while a value is made
//! or dropped.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Mutex, MutexGuard, PoisonError};

use lru::LruCache;

use super::Owner;

/// Bytes of an entry beside key and value: two links, their node and a table slot at its usual load factor.
/// Measured by tests/footprint.rs.
const ENTRY_BYTES: usize = 64;

/// Entries among which [`FairCache::latest`] looks.
const LOOKED_AT: usize = 256;

/// A byte-bounded cache. Values are handles that are cheap to clone.
pub struct FairCache<K, V> {
    max_bytes: usize,
    /// Values that are never evicted.
    must_stay: fn(&V) -> bool,
    entries: Mutex<Entries<K, V>>,
}

struct Entries<K, V> {
    of: HashMap<Owner, OfOwner<K, V>>,
    n_bytes: usize,
    /// Values evicted since the start.
    n_evicted: u64,
}

/// Numbers of entries: kept now, and evicted since the start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    pub n_kept: usize,
    pub n_evicted: u64,
}

struct OfOwner<K, V> {
    by_use: LruCache<K, Entry<V>>,
    n_bytes: usize,
}

struct Entry<V> {
    value: V,
    n_bytes: usize,
}

impl<K: Hash + Eq, V: Clone> FairCache<K, V> {
    /// Creates an empty cache of at most `max_bytes`.
    pub fn new(max_bytes: usize) -> Self {
        Self::sparing(max_bytes, |_| false)
    }

    /// Creates a cache that never evicts values for which `must_stay` holds. If only such values are left to
    /// evict, a new one is not kept.
    pub fn sparing(max_bytes: usize, must_stay: fn(&V) -> bool) -> Self {
        let entries = Entries { of: HashMap::new(), n_bytes: 0, n_evicted: 0 };
        Self { max_bytes, must_stay, entries: Mutex::new(entries) }
    }

    /// Finds a value and marks it as the most recently used.
    pub fn get(&self, owner: Owner, key: &K) -> Option<V> {
        self.lock().of.get_mut(&owner)?.by_use.get(key).map(|entry| entry.value.clone())
    }

    /// Keeps a value of `n_bytes`, replaces any value of the key and evicts others until the bound holds.
    /// Returns false if the value is larger than the cache, which keeps it out.
    pub fn insert(&self, owner: Owner, key: K, value: V, n_bytes: usize) -> bool {
        let mut gone = Vec::new();
        let mut entries = self.lock();
        let is_kept = self.keep(&mut entries, owner, key, value, n_bytes, &mut gone);
        drop(entries);
        is_kept
    }

    /// Finds the value of a key, or keeps this one. Returns the value and whether it is new. A value larger
    /// than the cache counts as new and is not kept.
    pub fn get_or_insert(
        &self,
        owner: Owner,
        key: K,
        value: V,
        n_bytes: impl FnOnce(&V) -> usize,
    ) -> (V, bool) {
        let n_bytes = n_bytes(&value);
        let mut gone = Vec::new();
        let mut entries = self.lock();
        let found =
            entries.of.get_mut(&owner).and_then(|of| of.by_use.get(&key)).map(|entry| entry.value.clone());
        let is_new = found.is_none();
        if is_new {
            self.keep(&mut entries, owner, key, value.clone(), n_bytes, &mut gone);
        }
        drop(entries);
        (found.unwrap_or(value), is_new)
    }

    /// Updates the weight of a value that has grown. An evicted value is not inserted again.
    pub fn reweigh(&self, owner: Owner, key: K, n_bytes: usize) {
        if let Some(value) = self.peek(owner, &key) {
            self.insert(owner, key, value, n_bytes);
        }
    }

    /// Evicts the least recently used value for which `may_go` holds. It is taken from `owner`, or else from
    /// the owner with most bytes among those who have such a value.
    pub fn evict(&self, owner: Option<Owner>, may_go: impl Fn(&V) -> bool) -> Option<V> {
        self.lock().evict(owner, may_go).map(|entry| entry.value)
    }

    /// Finds a value without marking it as used: its place in the order of eviction stays.
    pub fn peek(&self, owner: Owner, key: &K) -> Option<V> {
        self.lock().of.get(&owner)?.by_use.peek(key).map(|entry| entry.value.clone())
    }

    /// Removes a value and returns it.
    pub fn remove(&self, owner: Owner, key: &K) -> Option<V> {
        let gone = self.lock().remove(owner, key);
        gone.map(|entry| entry.value)
    }

    /// Removes all values of an owner whose key satisfies `is_meant`.
    pub fn remove_if(&self, owner: Owner, is_meant: impl Fn(&K) -> bool)
    where
        K: Clone,
    {
        let mut entries = self.lock();
        let of_owner = entries.of.get(&owner);
        let meant: Vec<K> = of_owner
            .into_iter()
            .flat_map(|of| of.by_use.iter())
            .map(|(key, _)| key)
            .filter(|key| is_meant(key))
            .cloned()
            .collect();
        let gone: Vec<_> = meant.iter().filter_map(|key| entries.remove(owner, key)).collect();
        drop(entries);
        drop(gone);
    }

    /// All values of an owner, in arbitrary order.
    pub fn values(&self, owner: Owner) -> Vec<V> {
        let entries = self.lock();
        let of_owner = entries.of.get(&owner);
        of_owner.into_iter().flat_map(|of| of.by_use.iter()).map(|(_, entry)| entry.value.clone()).collect()
    }

    /// Returns up to `count` values whose key satisfies `is_meant`, the latest used first. It looks at the
    /// latest used entries of the owner alone, so that the lock is held for a moment.
    pub fn latest(&self, owner: Owner, count: usize, is_meant: impl Fn(&K) -> bool) -> Vec<V> {
        let entries = self.lock();
        let latest = entries.of.get(&owner).into_iter().flat_map(|of| of.by_use.iter()).take(LOOKED_AT);
        latest.filter(|(key, _)| is_meant(key)).take(count).map(|(_, entry)| entry.value.clone()).collect()
    }

    /// Bytes of all values in the cache.
    pub fn n_bytes(&self) -> usize {
        self.lock().n_bytes
    }

    /// Numbers of values kept now and evicted since the start.
    pub fn counts(&self) -> Counts {
        let entries = self.lock();
        let n_kept = entries.of.values().map(|of| of.by_use.len()).sum();
        Counts { n_kept, n_evicted: entries.n_evicted }
    }

    /// Inserts an entry and evicts others. Removed entries go to `gone`, to be dropped after the lock.
    fn keep(
        &self,
        entries: &mut Entries<K, V>,
        owner: Owner,
        key: K,
        value: V,
        n_bytes: usize,
        gone: &mut Vec<Entry<V>>,
    ) -> bool {
        let n_bytes = n_bytes + ENTRY_BYTES + size_of::<K>();
        if n_bytes > self.max_bytes {
            return false;
        }
        gone.extend(entries.remove(owner, &key));
        entries.add(owner, key, Entry { value, n_bytes });
        while entries.n_bytes > self.max_bytes
            && let Some(evicted) = entries.evict(None, |value| !(self.must_stay)(value))
        {
            gone.push(evicted);
        }
        true
    }

    #[expect(
        clippy::disallowed_methods,
        reason = "a table, for a look-up: values are made and dropped outside"
    )]
    fn lock(&self) -> MutexGuard<'_, Entries<K, V>> {
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<K: Hash + Eq, V> Entries<K, V> {
    fn add(&mut self, owner: Owner, key: K, entry: Entry<V>) {
        let of =
            self.of.entry(owner).or_insert_with(|| OfOwner { by_use: LruCache::unbounded(), n_bytes: 0 });
        self.n_bytes += entry.n_bytes;
        of.n_bytes += entry.n_bytes;
        of.by_use.put(key, entry);
    }

    fn remove(&mut self, owner: Owner, key: &K) -> Option<Entry<V>> {
        let entry = self.of.get_mut(&owner)?.by_use.pop(key)?;
        self.account_for(owner, entry)
    }

    fn evict(&mut self, owner: Option<Owner>, may_go: impl Fn(&V) -> bool) -> Option<Entry<V>> {
        if let Some(owner) = owner {
            return self.evict_of(owner, may_go);
        }
        let mut owners: Vec<_> = self.of.iter().map(|(owner, of)| (of.n_bytes, *owner)).collect();
        owners.sort_unstable_by_key(|(n_bytes, _)| std::cmp::Reverse(*n_bytes));
        owners.into_iter().find_map(|(_, owner)| self.evict_of(owner, &may_go))
    }

    fn evict_of(&mut self, owner: Owner, may_go: impl Fn(&V) -> bool) -> Option<Entry<V>> {
        let of = self.of.get_mut(&owner)?;
        for _ in 0..of.by_use.len() {
            let (key, entry) = of.by_use.pop_lru()?;
            if may_go(&entry.value) {
                self.n_evicted += 1;
                return self.account_for(owner, entry);
            }
            // It is in use, so it becomes the most recently used one.
            of.by_use.put(key, entry);
        }
        None
    }

    fn account_for(&mut self, owner: Owner, entry: Entry<V>) -> Option<Entry<V>> {
        let of = self.of.get_mut(&owner)?;
        of.n_bytes -= entry.n_bytes;
        self.n_bytes -= entry.n_bytes;
        if of.by_use.is_empty() {
            self.of.remove(&owner);
        }
        Some(entry)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Owner = Owner(0);
    const B: Owner = Owner(1);

    /// Bytes of an entry beside its value.
    const OWN: usize = ENTRY_BYTES + size_of::<u32>();

    fn keys(cache: &FairCache<u32, u32>, owner: Owner) -> Vec<u32> {
        let mut values = cache.values(owner);
        values.sort_unstable();
        values
    }

    #[test]
    fn the_least_recently_used_makes_room() {
        let cache = FairCache::new(3 * (100 + OWN));
        (0..3).for_each(|k| assert!(cache.insert(A, k, k, 100)));
        assert_eq!(cache.get(A, &0), Some(0));
        assert!(cache.insert(A, 3, 3, 100));
        assert_eq!((keys(&cache, A), cache.n_bytes()), (vec![0, 2, 3], 3 * (100 + OWN)));
        assert!(!cache.insert(A, 4, 4, 1000));
        cache.reweigh(A, 0, 150);
        assert_eq!(keys(&cache, A), [0, 3]);
        assert_eq!((cache.remove(A, &0), cache.remove(A, &0)), (Some(0), None));
        cache.remove_if(A, |&key| key == 3);
        assert_eq!(cache.n_bytes(), 0);
    }

    #[test]
    fn an_owner_within_an_equal_share_loses_nothing_to_another() {
        let cache = FairCache::new(10 * (100 + OWN));
        (0..5).for_each(|k| assert!(cache.insert(B, k, k, 100)));
        (0..100).for_each(|k| assert!(cache.insert(A, k, k, 100)));
        assert_eq!((keys(&cache, A), keys(&cache, B)), ((95..100).collect(), (0..5).collect()));
    }

    #[test]
    fn the_latest_used_come_first_and_keep_their_places() {
        let cache = FairCache::new(1_000_000);
        (0..6).for_each(|key| assert!(cache.insert(A, key, 10 * key, 100)));
        cache.insert(B, 8, 80, 100);
        cache.get(A, &2);
        assert_eq!(cache.latest(A, 2, |key| key % 2 == 0), [20, 40]);
        assert_eq!(cache.latest(A, 9, |key| key % 2 == 0), [20, 40, 0]);
    }

    #[test]
    fn what_is_in_use_is_spared() {
        let cache = FairCache::new(1 << 20);
        (0..4).for_each(|k| assert!(cache.insert(A, k, k, 100)));
        assert_eq!(cache.evict(None, |&value| value >= 2), Some(2));
        assert_eq!(cache.evict(Some(A), |&value| value >= 4), None);
        assert_eq!(cache.evict(Some(B), |_| true), None);
        assert_eq!(keys(&cache, A), [0, 1, 3]);
        // All values of the owner with most bytes are in use, so another owner loses one.
        assert!(cache.insert(B, 7, 7, 100));
        assert_eq!(cache.evict(None, |&value| value >= 4), Some(7));
    }
}
