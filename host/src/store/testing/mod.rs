//! A store in memory whose calls a schedule interleaves: at random, or in every order.

pub mod choose;
#[path = "../../../../numerics/tests/common/random.rs"]
pub mod random;
pub mod stepped;
