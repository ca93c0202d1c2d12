//! Memory that many requests share: bytes reserved before they are used, computations that are made once for
//! all who ask, and caches from which nobody is pushed out.
//!
//! ONE COMPUTATION PER KEY. Requests for the same absent entry share one future (single_flight.rs), outside
//! any map lock. Every waiter polls the future, so the work survives the disconnect of the first client. When
//! the last waiter leaves, the future is dropped, which cancels the work. Failures go to all waiters and are
//! not cached.
//!
//! BYTES. Caches weigh an entry by its bytes on the heap. A full cache evicts the least recently used entry
//! of the owner who holds most (fair_cache.rs). An entry larger than the whole budget is served and not kept.

pub mod budget;
pub mod fair_cache;
pub mod single_flight;

/// An owner of what is kept: the position of the API key in the configuration, or the only owner of an open
/// service.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Owner(pub usize);

/// Returns the most of `whole` that one owner may hold, so that no owner can shut out the others: half,
/// rounded up. An owner without others has no bound beyond `whole` itself, which is checked separately.
pub fn share_of_one(whole: usize, n_owners: usize) -> usize {
    if n_owners > 1 { whole.div_ceil(2) } else { usize::MAX }
}

/// Origin of a cached result, in the terms of RFC 9211. Ordered by cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CacheOutcome {
    Hit,
    /// Computed for another request at the same time.
    Collapsed,
    /// Computed for this request and cached.
    Stored,
    /// Computed for this request, but larger than the whole cache.
    NotStored,
}
