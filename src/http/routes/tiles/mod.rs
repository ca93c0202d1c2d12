//! Routes for clouds that are answered in tiles, each a part of the cloud with what surrounds it.
//!
//! `coarse` chooses the points that say which side of the whole is outward. `regions` sums up what each tile
//! knows of the sides of its surface, and `sides` joins the sums of all tiles.

pub mod coarse;
mod fields;
pub mod regions;
pub mod sides;
