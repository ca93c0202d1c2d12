//! Clouds for the unit tests of this layer: those of the integration tests.

#[path = "../../tests/common/clouds.rs"]
mod clouds;
#[path = "../../tests/common/random.rs"]
mod random;

pub(crate) use clouds::{circle, fibonacci_sphere};
