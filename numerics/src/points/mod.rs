//! Geometry of a cloud from its positions alone, without a kernel: distances, neighbours, quadrics, noise.

pub(crate) mod cells;
pub mod cloud;
pub mod duplicates;
pub mod neighbours;
pub mod noise;
pub mod sampling;
pub mod thinning;

pub(crate) mod local_quadrics;
pub(crate) mod monomials;
pub(crate) mod neighbourhoods;
pub(crate) mod patch;
pub(crate) mod quadric;
