//! Tests under load.

mod contention;
mod sustained;
