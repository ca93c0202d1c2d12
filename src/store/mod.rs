//! State kept between requests: clouds, factorizations and weights, each bounded in bytes.
//!
//! KEYS. A factorization is named by everything that determines it: owner, cloud, kernel, regularization and
//! solver (key.rs). A result therefore never depends on who asked first. Clouds of one API key are invisible
//! to others.
//!
//! ONE COMPUTATION PER KEY. Requests for the same absent factor share one future (single_flight.rs), outside
//! any map lock. Every waiter polls the future, so the work survives the disconnect of the first client. When
//! the last waiter leaves, the future is dropped, which cancels the work. Failures go to all waiters and are
//! not cached.
//!
//! BYTES. The caches weigh an entry by its bytes on the heap. The sum is within 5 % of the resident set
//! (tests/footprint.rs). A full cache evicts the least recently used entry of the owner who holds most
//! (fair_cache.rs). An entry larger than the whole budget is served and not kept. Data shared by two entries
//! counts in both, since either may outlive the other. Factors, and all work with them, take their memory
//! from one budget (budget.rs). A factor holds its bytes until its last user drops it, and cached factors
//! make room for work.
//!
//! PERSISTENCE. Clouds may have a second level: objects in a directory or in object storage (objects/).
//! Memory is then a cache of the store. A cloud in neither of them is unknown.

pub mod budget;
pub mod clouds;
mod fair_cache;
pub mod key;
pub mod learned;
pub mod objects;
pub mod prepared;
mod single_flight;
#[cfg(test)]
pub mod testing;

pub use fair_cache::Counts;

/// An owner of clouds: the position of the API key in the configuration, or the only owner of an open
/// service.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Owner(pub usize);

/// Returns the most of `whole` that one owner may hold, so that no owner can shut out the others: half,
/// rounded up. An owner without others has no bound beyond `whole` itself, which is checked separately.
pub fn share_of_one(whole: usize, n_owners: usize) -> usize {
    if n_owners > 1 { whole.div_ceil(2) } else { usize::MAX }
}
