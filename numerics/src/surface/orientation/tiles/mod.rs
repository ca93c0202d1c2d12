//! Sides of a surface that is answered in tiles, each of which sees only a part of the cloud.
//!
//! A tile joins its points to regions and sums up what decides their sides ([`TileRegions`]). The regions of
//! all tiles are joined in one place, by the rules for a whole cloud ([`Tiling`]). Rims, gaps and winding
//! numbers need all points at once, so they are not looked at.

mod join;
mod pieces;
mod regions;
#[cfg(test)]
mod tests;

pub use join::{Side, Tiling};
pub use regions::{Border, LabelledRegions, Region, Tile, TileRegions};
pub(crate) use regions::{Signed, regions_of};
