//! Code shared by tests, benchmarks and examples: random numbers, clouds, kernels, and fits.

pub mod clouds;
pub mod fits;
pub mod hostile;
pub mod kernels;
pub mod random;
