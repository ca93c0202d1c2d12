//! `POST /v1/normals` and `POST /v1/curvatures`: the geometry of the surface that a cloud samples.

use std::sync::Arc;

use axum::Extension;
use axum::extract::{Request, State};
use axum::response::Response;

use crate::http::compute::JobObserver;
use crate::http::fields::{
    Degenerate, Diagnostics, Fit, OrientationChoice, SurfaceChoice, SurfaceUsed, request,
};
use crate::http::openapi::responses::ComputeProblems;
use crate::http::problem::Problem;
use crate::http::problem::slug::Slug;
use crate::http::serve::app::App;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::{Operation, Plan, serve};
use crate::http::serve::plan::Cost;
use crate::http::serve::planner::Planner;
use crate::http::wire::read::members::{present, present_word};
use crate::http::wire::read::points::Points;
use crate::http::wire::write::answer::answer;
use crate::http::wire::write::array::Array;
use crate::numerics::defaults::Purpose;
use crate::numerics::points::cloud::Cloud;
use crate::numerics::surface::geometry::{GeometryRequest, Orientation, SurfaceModel};
use crate::store::Owner;

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
    }
}

request! {
    /// A cloud that samples a hypersurface, and where its curvatures are wanted.
    pub struct CurvaturesRequest {
        /// Where answers are wanted; the points of the cloud if absent.
        #[serde(default, deserialize_with = "present")]
        #[schema(nullable = false, value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
        pub queries: Option<Points>,
        /// Which function's level surface is meant; `auto` if absent.
        #[serde(default, deserialize_with = "present_word")]
        #[schema(nullable = false)]
        pub surface: Option<SurfaceChoice>,
        /// Which way normals point, and with them the sign of curvatures; `outward` if absent.
        #[serde(default, deserialize_with = "present_word")]
        #[schema(nullable = false)]
        pub orientation: Option<OrientationChoice>,
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
        /// The queries where geometry has no meaning (null), or less accuracy than it seems.
        degenerate: Vec<Degenerate>,
        /// How the answer came about.
        diagnostics: Diagnostics,
    }
}

answer! {
    /// Curvatures of the surface at the queries.
    pub struct CurvaturesResponse {
        /// The d − 1 principal curvatures at each query, ascending, 1/length; null where there is none.
        #[schema(value_type = Vec<Option<Vec<f64>>>)]
        principal_curvatures: Array,
        /// A unit direction for each of them, its largest component positive; any basis where curvatures coincide.
        #[schema(value_type = Vec<Option<Vec<Vec<f64>>>>)]
        principal_directions: Array,
        /// Their average at each query, 1/length; null where there are none.
        #[schema(value_type = Vec<Option<f64>>)]
        mean_curvatures: Array,
        /// Their product at each query, 1/length to the d − 1; null where there are none.
        #[schema(value_type = Vec<Option<f64>>)]
        gaussian_curvatures: Array,
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

/// Compute curvatures
///
/// Principal curvatures with directions, mean and Gaussian curvature: eigenvalues of the shape operator S = σPD²uP/|∇u| of
/// the level surface of the signature function u, or of an offset model of the nearest points where the gradient of u
/// vanishes or is weak. A sphere of radius r has curvatures +1/r with outward normals. Entries that the points around a query
/// do not confirm are flagged.
#[utoipa::path(
    post,
    path = "/v1/curvatures",
    operation_id = "compute_curvatures",
    tag = "geometry",
    request_body = CurvaturesRequest,
    responses((status = 200, description = "Curvatures at the queries", body = CurvaturesResponse), ComputeProblems),
    security((), ("bearer" = []))
)]
pub async fn compute_curvatures(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    request: Request,
) -> Result<Response, Problem> {
    serve::<CurvaturesRequest>(app, owner, request).await
}

/// A checked request of either kind.
pub struct Work {
    queries: Arc<Cloud>,
    request: GeometryRequest,
}

impl Operation for NormalsRequest {
    type Work = Work;
    type Answer = NormalsResponse;
    const HAS_SURFACE: bool = true;

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<Work>, Problem> {
        let fit = self.take_fit();
        let request = geometry_request(self.surface, self.orientation, false);
        plan(planner, fit, self.queries, request, Purpose::Normals, |d| d + 2)
    }

    fn compute(work: Work, fits: &Fits, observer: &JobObserver) -> Result<NormalsResponse, Problem> {
        let surface = fits.geometry(&work.queries, &work.request, observer)?;
        let geometry = &surface.geometry;
        let (m, d) = (geometry.n_queries(), geometry.dimension());
        Ok(NormalsResponse {
            normals: surface.per_query(geometry.normals().to_vec(), &[m, d]),
            gradient_norms: Array::new(geometry.gradient_norms().to_vec(), &[m]),
            levels: Array::new(geometry.levels().to_vec(), &[m]),
            surfaces: surface.surfaces(),
            degenerate: surface.degenerate(),
            diagnostics: surface.diagnostics(fits),
        })
    }
}

impl Operation for CurvaturesRequest {
    type Work = Work;
    type Answer = CurvaturesResponse;
    const HAS_SURFACE: bool = true;

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<Work>, Problem> {
        let fit = self.take_fit();
        let request = geometry_request(self.surface, self.orientation, true);
        plan(planner, fit, self.queries, request, Purpose::Curvatures, |d| d * d + d + 3)
    }

    fn compute(work: Work, fits: &Fits, observer: &JobObserver) -> Result<CurvaturesResponse, Problem> {
        let surface = fits.geometry(&work.queries, &work.request, observer)?;
        let geometry = &surface.geometry;
        let (m, d) = (geometry.n_queries(), geometry.dimension());
        let curvatures = geometry.curvatures(observer).map_err(|error| fits.surface().refused(error))?;
        Ok(CurvaturesResponse {
            principal_curvatures: surface.per_query(curvatures.principal, &[m, d - 1]),
            principal_directions: surface.per_query(curvatures.directions, &[m, d - 1, d]),
            mean_curvatures: surface.per_query(curvatures.mean, &[m]),
            gaussian_curvatures: surface.per_query(curvatures.gaussian, &[m]),
            normals: surface.per_query(geometry.normals().to_vec(), &[m, d]),
            gradient_norms: Array::new(geometry.gradient_norms().to_vec(), &[m]),
            levels: Array::new(geometry.levels().to_vec(), &[m]),
            surfaces: surface.surfaces(),
            degenerate: surface.degenerate(),
            diagnostics: surface.diagnostics(fits),
        })
    }
}

fn plan(
    planner: &Planner<'_>,
    fit: Fit,
    queries: Option<Points>,
    request: GeometryRequest,
    purpose: Purpose,
    numbers_per_query: impl Fn(usize) -> usize,
) -> Result<Plan<Work>, Problem> {
    let mut main = planner.fit(fit, purpose)?;
    check_is_surface(&main.stored.cloud)?;
    let queries = planner.queries(queries, &mut [&mut main])?;
    let (n, m, d) = (main.n_points(), queries.n_points(), queries.dimension());
    let n_numbers = planner.check_answer(m.checked_mul(numbers_per_query(d)))?;
    // The sums over the points, and some thirty operations per entry of each shape operator.
    let sums = 60.0 * (n as f64) * (m + n) as f64 + 30.0 * m as f64 * (d as f64).powi(3);
    let offsets = match request.model {
        SurfaceModel::Offset => FLOPS_PER_OFFSET * m.min(MAX_OFFSETS) as f64,
        // Few queries need it; which, is not known before.
        SurfaceModel::Auto | SurfaceModel::Signature => 0.0,
    };
    let cost =
        Cost { flops: sums + offsets, n_numbers, n_scratch: 4 * n + numbers_at_query(d) * m, n_held: m * d };
    Ok(Plan { main, surface: None, work: Work { queries, request }, cost })
}

/// Numbers that the geometry at a query takes: two jets, normal, curvatures, directions, and what is said about it.
pub(super) fn numbers_at_query(dimension: usize) -> usize {
    20 + 6 * dimension * dimension
}

/// What the offset model costs at one query, in flops of a large factorization: 0.12 ms of one core.
const FLOPS_PER_OFFSET: f64 = 1e7;

/// Queries at which one request may ask the offset model: as much work as a factorization of 8,500 points.
const MAX_OFFSETS: usize = 20_000;

/// What a request asks of the geometry of its surface.
pub(super) fn geometry_request(
    surface: Option<SurfaceChoice>,
    orientation: Option<OrientationChoice>,
    checks_curvatures: bool,
) -> GeometryRequest {
    GeometryRequest {
        orientation: match orientation.unwrap_or_default() {
            OrientationChoice::Outward => Orientation::Outward,
            OrientationChoice::Gradient => Orientation::Gradient,
        },
        model: match surface.unwrap_or_default() {
            SurfaceChoice::Auto => SurfaceModel::Auto,
            SurfaceChoice::Signature => SurfaceModel::Signature,
            SurfaceChoice::Offset => SurfaceModel::Offset,
        },
        checks_curvatures,
        max_offsets: MAX_OFFSETS,
    }
}

/// Refuses geometry in dimension 1 before anything is computed.
pub(super) fn check_is_surface(cloud: &Cloud) -> Result<(), Problem> {
    if cloud.dimension() >= 2 {
        return Ok(());
    }
    let detail = "the geometry of a hypersurface needs points of dimension 2 or more, found 1";
    Err(Problem::of_field(Slug::InvalidCloud, "/cloud/points", detail))
}
