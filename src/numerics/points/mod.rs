//! What positions alone say, without a kernel: distances, neighbours, quadrics, noise.

pub mod cloud;
pub mod duplicates;
pub mod neighbours;
pub mod noise;

pub(crate) mod patch;
