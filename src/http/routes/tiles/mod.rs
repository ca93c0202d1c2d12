//! Routes for clouds that are answered in tiles, each a part of the cloud with what surrounds it.
//!
//! `coarse` chooses the points whose signature function orients the whole. `regions` groups the points of a
//! tile into consistently oriented regions, and `sides` orients the regions of all tiles.

pub mod coarse;
mod fields;
pub mod regions;
pub mod sides;
