//! What tests, benchmarks and examples share: random numbers, clouds, kernels, and fits of them.

pub mod clouds;
pub mod fits;
pub mod hostile;
pub mod kernels;
pub mod random;
