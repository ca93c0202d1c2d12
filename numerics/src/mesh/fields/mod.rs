//! Fields whose level sets are meshed: functions through values, and the surface that a cloud samples.

pub mod interpolant;
pub mod local;
pub(crate) mod quadrics;
