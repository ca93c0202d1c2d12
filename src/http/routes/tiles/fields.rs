//! Regions of tiles, as one request answers them and the next one sends them.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use gramian_numerics::orientation::tiles;

/// Neighbouring points of a tile whose normals agree, with sums over those that the tile answers for.
///
/// a is the area that a point x stands for, and ν its normal.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Region {
    /// Number of points.
    pub n_points: usize,
    /// Number of points where the coarse cloud determines the side.
    pub n_signed: usize,
    /// Number of points of the coarse cloud.
    pub n_coarse: usize,
    /// The sum of a.
    pub area: f64,
    /// The mean c of x, weighted with a.
    pub centre: Vec<f64>,
    /// The sum of a|x − c|².
    pub spread: f64,
    /// The sum of aν.
    pub normal: Vec<f64>,
    /// The sum of a(x − c)·ν.
    pub volume: f64,
    /// The lower corner of the box around all points of the region in the tile.
    pub lower: Vec<f64>,
    /// The upper corner of that box.
    pub upper: Vec<f64>,
}

/// Weights of the edges between two regions, or within one, by whether normals agree across them.
#[derive(Debug, Clone, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RegionAdjacency {
    /// The position of one of the two regions among those of the tile.
    pub first: usize,
    /// The position of the other one.
    pub second: usize,
    /// The weight of the edges across which the normals agree.
    pub agreeing: f64,
    /// The weight of the edges across which the normals are opposite.
    pub opposing: f64,
}

impl From<tiles::Region> for Region {
    fn from(region: tiles::Region) -> Self {
        let tiles::Region { n_points, n_signed, n_coarse, area, centre, .. } = region;
        let tiles::Region { spread, normal, volume, lower, upper, .. } = region;
        Self { n_points, n_signed, n_coarse, area, centre, spread, normal, volume, lower, upper }
    }
}

impl From<Region> for tiles::Region {
    fn from(region: Region) -> Self {
        let Region { n_points, n_signed, n_coarse, area, centre, .. } = region;
        let Region { spread, normal, volume, lower, upper, .. } = region;
        Self { n_points, n_signed, n_coarse, area, centre, spread, normal, volume, lower, upper }
    }
}

impl From<tiles::Border> for RegionAdjacency {
    fn from(tiles::Border { regions: [first, second], agreeing, opposing }: tiles::Border) -> Self {
        Self { first, second, agreeing, opposing }
    }
}

impl From<RegionAdjacency> for tiles::Border {
    fn from(RegionAdjacency { first, second, agreeing, opposing }: RegionAdjacency) -> Self {
        Self { regions: [first, second], agreeing, opposing }
    }
}
