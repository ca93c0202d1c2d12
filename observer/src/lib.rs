//! What a computation tells whoever runs it: its price before it begins, and its stages meanwhile.
//!
//! The mathematics (`gramian-numerics`) and the host that runs it (`gramian-host`) have this crate in common
//! and nothing else.

mod observer;
mod price;

pub use observer::{Cancelled, Observer, Stage, Unobserved, WithoutStages};
pub use price::Price;
