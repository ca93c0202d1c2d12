//! `POST /v1/tiles/regions`: the regions of a tile, and sums by which the side of each is decided.

use std::sync::Arc;

use super::fields::{Region, RegionAdjacency};
use crate::http::fields::{Diagnostics, request};
use crate::http::problem::Problem;
use crate::http::problem::catalogue;
use crate::http::routes::operation::operation;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::{Operation, Plan};
use crate::http::serve::plan::Cost;
use crate::http::serve::planner::Planner;
use gramian_host::answer;
use gramian_host::compute::JobObserver;
use gramian_host::wire::write::integers::Integers;
use gramian_numerics::kernel::defaults::Purpose;
use gramian_numerics::model::Report;
use gramian_numerics::orientation::tiles::Tile;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::surface::geometry::{GeometryRequest, SurfaceModel};
use gramian_numerics::surface::price::regions_price;

request! {
    /// A tile: a part of a cloud with the points around it, regressed locally.
    ///
    /// The normals of its cloud are directions outward by the signature function of the coarse cloud.
    pub struct RegionsRequest taking hyperparameters {
        /// The points that the tile answers for, by their positions in its cloud, ascending.
        pub own: Vec<usize>,
        /// The points that belong to the coarse cloud, likewise. Default: none.
        pub coarse: Option<Vec<usize>>,
    }
}

answer! {
    /// The regions of a tile, with sums that decide their sides.
    pub struct RegionsResponse {
        /// The region of each point of the tile, or −1 for points around it that no edge leads to.
        labels: Integers as Vec<i64>,
        /// The regions.
        regions: Vec<Region>,
        /// The borders between regions, and the edges within each.
        borders: Vec<RegionAdjacency>,
        /// The number of edges that the points would have on a surface that is sampled well.
        n_edges: usize,
        /// The numbers used, the method, its accuracy, and warnings.
        diagnostics: Diagnostics,
    }
}

operation! {
    /// Find the regions of a tile
    ///
    /// Joins the points of a tile whose normals agree with those of their neighbours, and sums up what
    /// decides the side of each region. `POST /v1/tiles/sides` joins the regions of all tiles.
    pub async fn compute_regions(RegionsRequest) -> RegionsResponse;
    path: "/v1/tiles/regions", tag: "tiles", answer: "The regions of the tile"
}

/// A checked request for regions.
pub struct RegionsWork {
    own: Vec<usize>,
    coarse: Vec<usize>,
    directions: Arc<Cloud>,
}

impl Operation for RegionsRequest {
    type Work = RegionsWork;

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<RegionsWork>, Problem> {
        let fit = self.take_fit();
        let request = GeometryRequest {
            model: SurfaceModel::Regression,
            checks_curvatures: false,
            ..GeometryRequest::CURVATURES
        };
        let main = planner.surface_fit(fit, Purpose::Normals, &request)?;
        let (n, d) = (main.on.n_points(), main.on.stored.cloud.dimension());
        let Some(directions) = main.on.stored.normals.clone() else {
            let detail = "the cloud of a tile needs normals: its outward directions";
            return Err(Problem::of_field(catalogue::INVALID_REQUEST, "/cloud/normals", detail));
        };
        let coarse = self.coarse.unwrap_or_default();
        check_points(&self.own, n, "/own")?;
        check_points(&coarse, n, "/coarse")?;
        let n_numbers = planner.check_answer(n.checked_mul(8 + 4 * d))?;
        let cost = Cost { work: regions_price(n, d), n_numbers, n_held: 2 * n };
        Ok(Plan::of_surface(main, RegionsWork { own: self.own, coarse, directions }, cost))
    }

    fn compute(work: RegionsWork, fits: &Fits, observer: &JobObserver) -> Result<RegionsResponse, Problem> {
        let (fitted, surface) = (fits.surface(), fits.made_surface()?);
        let tile = Tile { own: &work.own, coarse: &work.coarse };
        let found =
            surface.regions(&tile, &work.directions, observer).map_err(|error| fitted.refused(error))?;
        let label = |label: Option<usize>| label.map_or(-1, |label| label as i64);
        Ok(RegionsResponse {
            labels: Integers::new(found.labels.into_iter().map(label).collect()),
            regions: found.tile.regions.into_iter().map(Region::from).collect(),
            borders: found.tile.borders.into_iter().map(RegionAdjacency::from).collect(),
            n_edges: found.tile.n_edges,
            diagnostics: fitted.diagnostics(&Report::of_surface(surface), work.own.len()),
        })
    }
}

/// Checks that positions ascend within a cloud of n points.
fn check_points(points: &[usize], n: usize, pointer: &str) -> Result<(), Problem> {
    let is_wrong = |&at: &usize| points[at] >= n || at > 0 && points[at] <= points[at - 1];
    match (0..points.len()).find(is_wrong) {
        None => Ok(()),
        Some(at) => {
            let detail = format!("positions must ascend and be below the number of points, {n}");
            Err(Problem::invalid_request(format!("{pointer}/{at}"), detail))
        }
    }
}
