//! Planning shared by operations on surfaces: the request for geometry, and its price.

use std::sync::Arc;

use crate::http::fields::{Fit, GeometryAttribute, OrientationChoice, SurfaceModelChoice};
use crate::http::problem::Problem;
use crate::http::problem::catalogue;
use crate::http::serve::operation::Plan;
use crate::http::serve::plan::{Cost, PlannedSurface};
use crate::http::serve::planner::Planner;
use gramian_host::wire::read::points::Points;
use gramian_numerics::kernel::defaults::Purpose;
use gramian_numerics::machine::price::Sizes;
use gramian_numerics::model::price::geometry_price;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::surface::geometry::{GeometryRequest, Orientation, SurfaceModel};
use gramian_numerics::surface::price::{AskedOfSurface, MAX_OFFSETS, Offsets};

/// A checked request for normals or curvatures.
pub struct GeometryWork {
    pub queries: Arc<Cloud>,
    pub request: GeometryRequest,
}

/// Plans normals or curvatures. `numbers_per_query` maps the dimension d to the numbers of an answer per
/// query.
///
/// # Errors
/// Returns a [`Problem`] with a pointer to the field.
pub fn plan_geometry(
    planner: &Planner<'_>,
    fit: Fit,
    queries: Option<Points>,
    request: GeometryRequest,
    purpose: Purpose,
    numbers_per_query: impl Fn(usize) -> usize,
) -> Result<Plan<GeometryWork>, Problem> {
    let mut main = planner.surface_fit(fit, purpose, &request)?;
    check_is_surface(&main.on.stored.cloud)?;
    let queries = planner.queries(queries, &mut main.on)?;
    let (m, d) = (queries.n_points(), queries.dimension());
    let of_edges = if request.has_edge_normals { 2 * d } else { 0 };
    let n_numbers = planner.check_answer(m.checked_mul(numbers_per_query(d) + of_edges))?;
    let sizes = Sizes { n_points: main.on.n_points(), n_queries: m, dimension: d };
    let work = geometry_price(main.solver(), asked_of(&request, &main, &queries), sizes);
    let cost = Cost { work, n_numbers, n_held: m * d };
    Ok(Plan::of_surface(main, GeometryWork { queries, request }, cost))
}

/// Translates the options of a request into options of the numerics, with defaults for absent ones.
pub fn geometry_request(
    surface: Option<SurfaceModelChoice>,
    orientation: Option<OrientationChoice>,
    checks_curvatures: bool,
    include: Option<&[GeometryAttribute]>,
) -> GeometryRequest {
    let has = |part| include.is_some_and(|include| include.contains(&part));
    GeometryRequest {
        orientation: match orientation.unwrap_or_default() {
            OrientationChoice::Outward => Orientation::Outward,
            OrientationChoice::Gradient => Orientation::Gradient,
        },
        model: match surface.unwrap_or_default() {
            SurfaceModelChoice::Auto => SurfaceModel::Auto,
            SurfaceModelChoice::Signature => SurfaceModel::Signature,
            SurfaceModelChoice::Offset => SurfaceModel::Offset,
            SurfaceModelChoice::Regression => SurfaceModel::Regression,
        },
        checks_curvatures,
        max_offsets: MAX_OFFSETS,
        has_deviations: has(GeometryAttribute::Std),
        has_edge_normals: has(GeometryAttribute::EdgeNormals),
    }
}

/// Returns the parts of a surface that a request uses, as far as its price depends on them.
pub fn asked_of(request: &GeometryRequest, surface: &PlannedSurface, queries: &Cloud) -> AskedOfSurface {
    let offsets = match (request.model, request.checks_curvatures) {
        (SurfaceModel::Offset, _) => Offsets::Everywhere,
        (SurfaceModel::Auto | SurfaceModel::Signature | SurfaceModel::Regression, true) => {
            Offsets::Confirmations
        }
        (SurfaceModel::Auto | SurfaceModel::Signature | SurfaceModel::Regression, false) => Offsets::Rescues,
    };
    let are_points = *queries == *surface.on.stored.cloud;
    AskedOfSurface {
        offsets,
        has_own_quadrics: request.checks_curvatures && !are_points,
        has_deviations: request.has_deviations,
    }
}

/// Refuses geometry in dimension 1 before anything is computed.
pub fn check_is_surface(cloud: &Cloud) -> Result<(), Problem> {
    if cloud.dimension() >= 2 {
        return Ok(());
    }
    let detail = "the geometry of a hypersurface needs points of dimension 2 or more, found 1";
    Err(Problem::of_field(catalogue::INVALID_CLOUD, "/cloud/points", detail))
}
