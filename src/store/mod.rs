//! What is kept between requests: clouds, factorizations and weights, each bounded in bytes.
//!
//! KEYS. A factorization is named by everything that determines it: owner, cloud, kernel, regularization, solver (key.rs). A
//! result therefore never depends on who asked first, and clouds of one API key are invisible to others.
//!
//! ONE COMPUTATION PER KEY. Requests for the same absent factor share one future (single_flight.rs), outside any map lock.
//! Each waiter polls it, so it survives the first client's disconnect; when the last waiter is gone it is dropped, which
//! cancels the work. Failures are handed to whoever waits and are not kept.
//!
//! BYTES. The moka caches weigh entries in KiB and evict the least recently used first. An entry beyond the whole budget is
//! served and not kept. Evicted entries still in use keep their memory until their request ends.

pub mod clouds;
pub mod factors;
pub mod key;
mod single_flight;

use moka::policy::EvictionPolicy;
use moka::sync::{Cache, CacheBuilder};

/// Whose clouds are meant: the position of the API key in the configuration, or the one owner of an open service.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Owner(pub usize);

/// Starts a cache bounded in bytes, least recently used out first.
fn bounded_cache<K, V>(
    max_bytes: u64,
    n_bytes: impl Fn(&V) -> usize + Send + Sync + 'static,
) -> CacheBuilder<K, V, Cache<K, V>>
where
    K: std::hash::Hash + Eq + Send + Sync + 'static,
    V: Clone + Send + Sync + 'static,
{
    Cache::builder()
        .max_capacity(max_bytes / 1024)
        .weigher(move |_, value| u32::try_from(n_bytes(value).div_ceil(1024)).unwrap_or(u32::MAX))
        .eviction_policy(EvictionPolicy::lru())
        .support_invalidation_closures()
}
