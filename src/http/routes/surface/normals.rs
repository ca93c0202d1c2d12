//! `POST /v1/normals`.

use std::sync::Arc;

use axum::Extension;
use axum::extract::{Request, State};
use axum::response::Response;

use super::common::{GeometryWork, geometry_request, plan_geometry};
use crate::http::compute::JobObserver;
use crate::http::fields::{
    Degenerate, Diagnostics, Fit, GeometryInclude, OrientationChoice, SurfaceChoice, SurfaceUsed, request,
};
use crate::http::openapi::responses::ComputeProblems;
use crate::http::problem::Problem;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::{Operation, Plan, serve};
use crate::http::serve::planner::Planner;
use crate::http::state::app::App;
use crate::http::wire::read::members::{present, present_unless_empty, present_word, present_words};
use crate::http::wire::read::points::Points;
use crate::http::wire::write::answer::answer;
use crate::http::wire::write::array::Array;
use crate::store::Owner;
use gramian_numerics::kernel::defaults::Purpose;

request! {
    /// A cloud that samples a hypersurface, and where its normals are wanted.
    pub struct NormalsRequest {
        /// Where answers are wanted; the points of the cloud if absent.
        #[serde(default, deserialize_with = "present")]
        #[schema(nullable = false, value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
        pub queries: Option<Points>,
        /// Which function's level surface is meant; `auto` if absent.
        #[serde(default, deserialize_with = "present_word")]
        #[schema(nullable = false)]
        pub surface: Option<SurfaceChoice>,
        /// Which way normals point; `outward` if absent.
        #[serde(default, deserialize_with = "present_word")]
        #[schema(nullable = false)]
        pub orientation: Option<OrientationChoice>,
        /// What is wanted beside what every answer has.
        #[serde(default, deserialize_with = "present_words")]
        #[schema(nullable = false)]
        pub include: Option<Vec<GeometryInclude>>,
        /// Where `"solver": "local"` learns noise and shape of the surface, at most 192 points of the cloud; 96 to
        /// 191 that it chooses if absent. Parts of one cloud with the same sites, and the points around them,
        /// learn the same.
        #[serde(default, deserialize_with = "present_unless_empty")]
        #[schema(nullable = false, value_type = Option<Vec<Vec<f64>>>, max_items = 192)]
        pub sites: Option<Points>,
    }
}

answer! {
    /// Unit normals of the surface at the queries.
    pub struct NormalsResponse {
        /// The normal at each query, of length 1; null where there is none.
        #[schema(value_type = Vec<Option<Vec<f64>>>)]
        normals: Array,
        /// |∇u| of the function in `surfaces` at each query: 1/length for `signature`, about 1 for `offset`.
        #[schema(value_type = Vec<f64>)]
        gradient_norms: Array,
        /// The signature function at each query: 1 on the surface, usually more inside a closed one.
        #[schema(value_type = Vec<f64>)]
        levels: Array,
        /// The function whose level surface was used at each query; `signature` where there is no answer.
        surfaces: Vec<SurfaceUsed>,
        /// Standard deviation of the angle of the normal at each query, radians: within 1.96 of it lie 95 % of the angles; null where
        /// there is no answer or none is known.
        #[schema(value_type = Option<Vec<Option<f64>>>, nullable = false)]
        normal_deviations: Option<Array>,
        /// The queries where geometry has no meaning (null), or less accuracy than it seems.
        degenerate: Vec<Degenerate>,
        /// How the answer came about.
        diagnostics: Diagnostics,
    }
}

/// Compute normals
///
/// The unit normals ν = −∇u/|∇u| (outward) of the level surface of the signature function u, the interpolant of the
/// constant 1. The cloud needs no mesh and no neighbourhoods. Signs are checked against the neighbours and repaired; where
/// the gradient of u vanishes, an offset model of the nearest points answers in its place.
#[utoipa::path(
    post,
    path = "/v1/normals",
    operation_id = "compute_normals",
    tag = "geometry",
    request_body = NormalsRequest,
    responses((status = 200, description = "Normals at the queries", body = NormalsResponse), ComputeProblems),
    security((), ("bearer" = []))
)]
pub async fn compute_normals(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    request: Request,
) -> Result<Response, Problem> {
    serve::<NormalsRequest>(app, owner, request).await
}

impl Operation for NormalsRequest {
    const NAME: &'static str = "compute_normals";
    type Work = GeometryWork;
    type Answer = NormalsResponse;
    const HAS_SURFACE: bool = true;

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<GeometryWork>, Problem> {
        let fit = Fit { sites: self.sites.take(), ..self.take_fit() };
        let request = geometry_request(self.surface, self.orientation, false, self.include.as_deref());
        plan_geometry(planner, fit, self.queries, request, Purpose::Normals, |d| d + 3)
    }

    fn compute(work: GeometryWork, fits: &Fits, observer: &JobObserver) -> Result<NormalsResponse, Problem> {
        let surface = fits.geometry(&work.queries, &work.request, observer)?;
        let geometry = &surface.geometry;
        let (m, d) = (geometry.n_queries(), geometry.dimension());
        Ok(NormalsResponse {
            normals: surface.per_query(geometry.normals().to_vec(), &[m, d]),
            gradient_norms: Array::new(geometry.gradient_norms().to_vec(), &[m]),
            levels: Array::new(geometry.levels().to_vec(), &[m]),
            surfaces: surface.surfaces(),
            degenerate: surface.degenerate(),
            normal_deviations: surface.deviations().map(|deviations| deviations.normal),
            diagnostics: surface.diagnostics(fits),
        })
    }
}
