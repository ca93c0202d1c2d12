//! Tests of what is kept: clouds, factors and jobs, in memory and in the store.

mod cache;
mod clouds;
mod clouds_at_once;
pub mod durable;
mod idempotency;
pub mod jobs;
mod kept_jobs;
