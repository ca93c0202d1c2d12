//! What is kept between requests: clouds, factorizations and weights, each bounded in bytes.
//!
//! KEYS. A factorization is named by everything that determines it: owner, cloud, kernel, regularization, solver (key.rs). A
//! result therefore never depends on who asked first, and clouds of one API key are invisible to others.
//!
//! ONE COMPUTATION PER KEY. Requests for the same absent factor share one future (single_flight.rs), outside any map lock.
//! Each waiter polls it, so it survives the first client's disconnect; when the last waiter is gone it is dropped, which
//! cancels the work. Failures are handed to whoever waits and are not kept.
//!
//! BYTES. The caches weigh entries by what they take on the heap, within 5 % of the resident set (tests/footprint.rs), and evict
//! the least recently used first, of the owner who has most (fair_cache.rs). An entry beyond the whole budget is served and not
//! kept. What two entries share is counted in both, since either may outlive the other. Factors, and all work with them,
//! take their memory from one budget (budget.rs): a factor holds its part for as long as anybody holds the factor, and
//! what is kept makes room for work.
//!
//! WHAT OUTLIVES THE PROCESS. Clouds may have a second level, objects in a directory or in object storage (objects/). Memory is a cache
//! of it then; what is in neither is not there.

pub mod budget;
pub mod clouds;
mod fair_cache;
pub mod key;
pub mod learned;
pub mod objects;
pub mod prepared;
mod single_flight;

pub use fair_cache::Counts;

/// Whose clouds are meant: the position of the API key in the configuration, or the one owner of an open service.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Owner(pub usize);
