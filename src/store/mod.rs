//! State kept between requests: clouds, factorizations and weights, each bounded in bytes.
//!
//! KEYS. A factorization is named by everything that determines it: owner, cloud, kernel, regularization and
//! solver (key.rs). A result therefore never depends on who asked first. Clouds of one API key are invisible
//! to others.
//!
//! BYTES. The caches weigh an entry by its bytes on the heap. The sum is within 5 % of the resident set
//! (tests/footprint.rs). Data shared by two entries counts in both, since either may outlive the other.
//! Factors take their memory from the budget for work. A factor holds its bytes until its last user drops it,
//! and cached factors make room for work.
//!
//! PERSISTENCE. Clouds may have a second level: objects in a directory or in object storage (objects/).
//! Memory is then a cache of the store. A cloud in neither of them is unknown.

pub mod clouds;
pub mod key;
pub mod learned;
pub mod objects;
pub mod prepared;
#[cfg(test)]
#[allow(dead_code, reason = "the host uses all of it")]
#[path = "../../host/src/store/testing/mod.rs"]
mod testing;

pub use gramian_host::memory::fair_cache::Counts;
