//! `POST /v1/tiles/coarse`: the part of a cloud by which the outward side of its surface is decided.

use std::sync::Arc;

use axum::Extension;
use axum::extract::{Request, State};
use axum::response::Response;
use serde::Deserialize;
use utoipa::ToSchema;

use crate::http::fields::KernelUsed;
use crate::http::openapi::responses::ComputeProblems;
use crate::http::problem::{Pointers, Problem, from_numerics};
use crate::http::serve::planner::unregistered;
use crate::http::state::app::App;
use gramian_host::answer;
use gramian_host::compute::JobObserver;
use gramian_host::memory::Owner;
use gramian_host::operation::{Operation, operation, serve};
use gramian_host::wire::negotiation::Format;
use gramian_host::wire::read::points::Points;
use gramian_numerics::machine::price::Price;
use gramian_numerics::regression::sums::regularization::Regularization;
use gramian_numerics::surface::local::coarse::CoarseCloud;
use gramian_numerics::surface::price::coarse_price;

/// A cloud, and how noisy it is.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CoarseRequest {
    /// The points of the cloud, or some of a large one, chosen evenly.
    #[schema(value_type = Vec<Vec<f64>>, min_items = 1)]
    pub points: Points,
    /// The number of points to choose. Default: a sixth, at least 600 (or all points) and at most 6,000.
    #[schema(minimum = 1)]
    pub count: Option<usize>,
    /// The standard deviation of the noise of the points across the surface. Default: 0.
    #[schema(minimum = 0.0)]
    pub noise_deviation: Option<f64>,
}

answer! {
    /// A coarse cloud with the kernel and alpha of its signature function.
    pub struct CoarseResponse {
        /// The points, by their positions in the cloud, ascending. No two coincide.
        points: Vec<usize>,
        /// The kernel of the signature function.
        kernel: KernelUsed,
        /// Added to the diagonal of its matrix.
        alpha: f64,
    }
}

/// Choose a coarse cloud
///
/// Chooses points that are spread as the cloud is. Minus the gradient of the interpolant of the constant 1 at
/// these points, with this kernel and alpha, points out of closed surfaces. Local regressions orient their
/// normals by it. Tiles of a cloud orient theirs alike if they all take that of the whole cloud.
#[utoipa::path(
    post,
    path = "/v1/tiles/coarse",
    tag = "tiles",
    request_body = CoarseRequest,
    responses((status = 200, description = "The coarse cloud", body = CoarseResponse), ComputeProblems)
)]
pub async fn choose_coarse_cloud(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    request: Request,
) -> Result<Response, Problem> {
    serve(app.host.clone(), owner, request, operation::<CoarseRequest>(app)).await
}

impl Operation for CoarseRequest {
    const NAME: &'static str = "choose_coarse_cloud";
    const FORMATS: &'static [Format] = &[Format::Json];
    type Answer = CoarseResponse;
    type Context = Arc<App>;

    fn plan(&self, _: &Arc<App>) -> Result<Price, Problem> {
        if self.noise_deviation.is_some_and(|noise| noise < 0.0) {
            return Err(Problem::invalid_request("/noise_deviation", "must be 0 or more"));
        }
        if self.count == Some(0) {
            return Err(Problem::invalid_request("/count", "must be 1 or more"));
        }
        Ok(coarse_price(self.points.n_rows, self.points.dimension, self.count))
    }

    fn compute(self, app: &Arc<App>, observer: &JobObserver) -> Result<CoarseResponse, Problem> {
        let noise = self.noise_deviation.unwrap_or_default();
        let cloud = unregistered(app, self.points, "/points")?;
        let refuse = |error| from_numerics(error, Pointers { points: "/points", ..Pointers::REQUEST });
        let coarse = CoarseCloud::of(&cloud, self.count, noise, observer).map_err(refuse)?;
        if Regularization::uniform(coarse.alpha).is_err() {
            let detail = "is too large beside the spacing of the points: alpha exceeds 1e300";
            return Err(Problem::invalid_request("/noise_deviation", detail));
        }
        let CoarseCloud { points, kernel, alpha, .. } = coarse;
        Ok(CoarseResponse { points, kernel: KernelUsed::scaled(&kernel, 1.0), alpha })
    }
}
