//! What tests, benchmarks and examples share: random numbers, clouds, and fits of them.

pub mod clouds;
pub mod fits;
pub mod random;
