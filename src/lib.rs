//! gramian
pub mod numerics;
