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

use super::pieces::MAX_LARGE;
use crate::machine::price::Price;
pub use join::{Side, Tiling};
pub use regions::{Border, LabelledRegions, Region, Tile, TileRegions};
pub(crate) use regions::{SignedPoints, regions_of};

/// Flops for a region with its rows on the heap, for a coordinate of it, for a comparison of two boxes, and
/// for each step of sorting borders: estimates of 1 µs, 10 ns, 3 ns and 10 ns.
const FLOPS_PER_REGION: f64 = 2e4;
const FLOPS_PER_COORDINATE: f64 = 200.0;
const FLOPS_PER_COMPARISON: f64 = 60.0;
const FLOPS_PER_SORTED: f64 = 200.0;

/// Numbers of lists that grow with the regions, borders and links of all tiles.
#[derive(Debug, Clone, Copy, Default)]
pub struct TilingSize {
    pub n_regions: usize,
    /// Borders and links.
    pub n_borders: usize,
    /// Coordinates of all rows of all regions, four rows each.
    pub n_coordinates: usize,
}

/// The price of the sides of regions. Each region may be a piece of its own, and is then compared with every
/// large piece.
pub fn sides_price(size: TilingSize) -> Price {
    let TilingSize { n_regions, n_borders, n_coordinates } = size;
    let n_numbers = n_regions
        .saturating_mul(40)
        .saturating_add(n_borders.saturating_mul(12))
        .saturating_add(n_coordinates);
    let n_compared = n_regions as f64 * n_regions.min(MAX_LARGE) as f64;
    let sorted = n_borders as f64 * (n_borders as f64).max(2.0).log2();
    let flops = FLOPS_PER_REGION * n_regions as f64
        + FLOPS_PER_COORDINATE * n_coordinates as f64
        + FLOPS_PER_COMPARISON * n_compared
        + FLOPS_PER_SORTED * sorted;
    Price::of_numbers(n_numbers, flops)
}
