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

use crate::machine::price::Price;
pub use join::{Side, Tiling};
pub use regions::{Border, LabelledRegions, Region, Tile, TileRegions};
pub(crate) use regions::{Signed, regions_of};

/// The price of the sides of regions, with so many borders and links.
pub fn sides_price(n_regions: usize, n_borders: usize) -> Price {
    let n_numbers = n_regions.saturating_mul(24).saturating_add(n_borders.saturating_mul(8));
    Price::of_numbers(n_numbers, 50.0 * (n_regions + n_borders) as f64)
}

/// Sum of counts that a client sent, which may be of any size.
fn total(counts: impl Iterator<Item = usize>) -> usize {
    counts.fold(0, usize::saturating_add)
}
