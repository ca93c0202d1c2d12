//! gramian
pub mod config;
pub mod numerics;
pub mod store;
