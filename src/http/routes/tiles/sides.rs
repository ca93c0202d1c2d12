//! `POST /v1/tiles/sides`: the sides of the regions of all tiles.

use std::sync::Arc;

use axum::Extension;
use axum::extract::{Request, State};
use axum::response::Response;
use serde::Deserialize;
use utoipa::ToSchema;

use super::fields::{Region, RegionAdjacency};
use crate::http::openapi::responses::ComputeProblems;
use crate::http::problem::{Pointers, Problem, from_numerics};
use crate::http::state::app::App;
use gramian_host::answer;
use gramian_host::compute::JobObserver;
use gramian_host::memory::Owner;
use gramian_host::operation::{Operation, operation, serve};
use gramian_host::wire::negotiation::Format;
use gramian_numerics::machine::price::Price;
use gramian_numerics::orientation::tiles::{self, Tiling, TilingSize};

/// The regions of all tiles of a cloud, and which of them are parts of one region.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SidesRequest {
    /// The regions of each tile, as `POST /v1/tiles/regions` answers them.
    pub tiles: Vec<TileRegions>,
    /// Pairs of regions that have a point in common, counted on from one tile to the next.
    pub links: Vec<RegionOverlap>,
}

/// Two regions that have a point in common.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RegionOverlap {
    /// The position of one of them among the regions of all tiles.
    pub first: usize,
    /// The position of the other one.
    pub second: usize,
}

/// The regions of a tile.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct TileRegions {
    /// The regions.
    pub regions: Vec<Region>,
    /// Their borders.
    pub borders: Vec<RegionAdjacency>,
    /// The number of edges that the points would have on a surface that is sampled well.
    pub n_edges: usize,
}

answer! {
    /// The sides of regions, in the order of the request.
    pub struct SidesResponse {
        /// 1 or −1 for each region: the sign to multiply its normals with.
        signs: Vec<i8>,
        /// True for each region whose side is nearly a matter of chance.
        are_doubtful: Vec<bool>,
    }
}

/// Join the regions of tiles
///
/// Chooses the sides of all regions together, by the rules for a whole cloud: regions are joined across their
/// surest borders, and each connected piece has the side that its volume or its coarse cloud says.
#[utoipa::path(
    post,
    path = "/v1/tiles/sides",
    tag = "tiles",
    request_body = SidesRequest,
    responses((status = 200, description = "The sides of all regions", body = SidesResponse), ComputeProblems)
)]
pub async fn choose_sides(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    request: Request,
) -> Result<Response, Problem> {
    serve(app.host.clone(), owner, request, operation::<SidesRequest>(())).await
}

impl Operation for SidesRequest {
    const NAME: &'static str = "choose_sides";
    const FORMATS: &'static [Format] = &[Format::Json];
    type Answer = SidesResponse;
    type Context = ();

    fn plan(&self, (): &()) -> Result<Price, Problem> {
        let of_region = |region: &Region| {
            region.centre.len() + region.normal.len() + region.lower.len() + region.upper.len()
        };
        let mut size = TilingSize { n_borders: self.links.len(), ..TilingSize::default() };
        for tile in &self.tiles {
            size.n_regions += tile.regions.len();
            size.n_borders += tile.borders.len();
            size.n_coordinates += tile.regions.iter().map(of_region).sum::<usize>();
        }
        Ok(tiles::sides_price(size))
    }

    fn compute(self, (): &(), observer: &JobObserver) -> Result<SidesResponse, Problem> {
        let tiles: Vec<tiles::TileRegions> = self.tiles.into_iter().map(TileRegions::into).collect();
        let refuse = |error| from_numerics(error, Pointers::REQUEST);
        let links: Vec<[usize; 2]> = self.links.iter().map(|link| [link.first, link.second]).collect();
        let tiling = Tiling::of(&tiles, &links, observer).map_err(refuse)?;
        let sides = tiling.sides(observer).map_err(refuse)?;
        Ok(SidesResponse {
            signs: sides.iter().map(|side| if side.sign < 0.0 { -1 } else { 1 }).collect(),
            are_doubtful: sides.iter().map(|side| side.is_doubtful).collect(),
        })
    }
}

impl From<TileRegions> for tiles::TileRegions {
    fn from(TileRegions { regions, borders, n_edges }: TileRegions) -> Self {
        Self {
            regions: regions.into_iter().map(Region::into).collect(),
            borders: borders.into_iter().map(RegionAdjacency::into).collect(),
            n_edges,
        }
    }
}
