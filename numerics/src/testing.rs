//! Clouds and kernels for the unit tests of this layer: those of the integration tests.

#[path = "../tests/common/clouds.rs"]
mod clouds;
#[path = "../tests/common/kernels.rs"]
mod kernels;
#[path = "../tests/common/random.rs"]
mod random;

pub(crate) use clouds::{circle, fibonacci_sphere};
pub(crate) use kernels::all_families;
pub(crate) use random::Random;
