//! What is kept between requests: clouds, factorizations and weights, each bounded in bytes.
//!
//! KEYS. A factorization is named by everything that determines it: owner, cloud, kernel, regularization, solver (key.rs). A
//! result therefore never depends on who asked first, and clouds of one API key are invisible to others.
//!
//! ONE COMPUTATION PER KEY. Requests for the same absent factor share one future (single_flight.rs), outside any map lock.
//! Each waiter polls it, so it survives the first client's disconnect; when the last waiter is gone it is dropped, which
//! cancels the work. Failures are handed to whoever waits and are not kept.
//!
//! BYTES. The moka caches weigh entries by what they take on the heap, within 5 % of the resident set (tests/footprint.rs),
//! and evict the least recently used first. An entry beyond the whole budget is served and not kept. What two entries
//! share is counted in both, since either may outlive the other. Evicted entries still in use keep their memory until their
//! request ends.

pub mod clouds;
pub mod factors;
pub mod key;
mod single_flight;

use moka::policy::EvictionPolicy;
use moka::sync::{Cache, CacheBuilder};

/// Whose clouds are meant: the position of the API key in the configuration, or the one owner of an open service.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Owner(pub usize);

/// The unit of weights: moka has 32 bits for each, which reach 256 GiB.
const WEIGHT_UNIT: usize = 64;

/// Bytes that moka 0.12.16 keeps for an entry beside key and value: a node of its queue, the entry with its counters, a slot
/// of the table. As measured by tests/footprint.rs.
const ENTRY_BYTES: usize = 270;

/// Starts a cache bounded in bytes, least recently used out first; `n_bytes` are those behind the `Arc` that is the value.
fn bounded_cache<K, V>(
    max_bytes: u64,
    n_bytes: impl Fn(&V) -> usize + Send + Sync + 'static,
) -> CacheBuilder<K, V, Cache<K, V>>
where
    K: std::hash::Hash + Eq + Send + Sync + 'static,
    V: Clone + Send + Sync + 'static,
{
    Cache::builder()
        .max_capacity(max_bytes / WEIGHT_UNIT as u64)
        .weigher(move |_, value| {
            let n_bytes = ENTRY_BYTES + size_of::<K>() + n_bytes(value);
            u32::try_from(n_bytes.div_ceil(WEIGHT_UNIT)).unwrap_or(u32::MAX)
        })
        .eviction_policy(EvictionPolicy::lru())
        .support_invalidation_closures()
}

/// Bytes that the entries of a cache weigh, once it has caught up with what was put in.
fn n_bytes_of<K, V>(cache: &Cache<K, V>) -> u64
where
    K: std::hash::Hash + Eq + Send + Sync + 'static,
    V: Clone + Send + Sync + 'static,
{
    cache.run_pending_tasks();
    cache.weighted_size() * WEIGHT_UNIT as u64
}
