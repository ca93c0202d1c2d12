//! What operations on surfaces share: checked work, its price, and its diagnostics.

use std::sync::Arc;

use crate::http::compute::JobObserver;
use crate::http::fields::{Diagnostics, Fit, Geometry, OrientationChoice, SurfaceChoice};
use crate::http::problem::Problem;
use crate::http::problem::slug::Slug;
use crate::http::serve::fitted::{Fits, SurfaceGeometry};
use crate::http::serve::operation::Plan;
use crate::http::serve::plan::Cost;
use crate::http::serve::planner::Planner;
use crate::http::wire::read::points::Points;
use crate::numerics::defaults::Purpose;
use crate::numerics::points::cloud::Cloud;
use crate::numerics::solver::choose::{Asked, MAX_OFFSETS, Offsets, work_price};
use crate::numerics::surface::geometry::{GeometryRequest, Orientation, SurfaceModel};

/// A checked request for normals or curvatures.
pub struct GeometryWork {
    pub queries: Arc<Cloud>,
    pub request: GeometryRequest,
}

/// A checked request to apply an operator to values.
pub struct AppliedWork {
    pub values: Vec<f64>,
    pub queries: Arc<Cloud>,
    pub request: GeometryRequest,
}

/// A checked request for an operator as a matrix.
pub struct MatrixWork {
    pub queries: Arc<Cloud>,
    pub request: GeometryRequest,
}

impl MatrixWork {
    /// Without values, the quality of the main fit is that of Y = 1.
    ///
    /// # Errors
    /// Those of the solve.
    pub fn diagnostics(
        &self,
        fits: &Fits,
        surface: &SurfaceGeometry,
        observer: &JobObserver,
    ) -> Result<Diagnostics, Problem> {
        let m = self.queries.n_points();
        let constant = match &fits.surface {
            None => surface.surface.signature().clone(),
            Some(_) => fits.interpolant(&vec![1.0; fits.main.plan.stored.cloud.n_points()], observer)?,
        };
        let mut diagnostics = fits.main.diagnostics(&constant.solution, m);
        diagnostics.geometry = Some(Box::new(surface.diagnostics(fits)));
        Ok(diagnostics)
    }
}

/// Plans normals or curvatures, with so many numbers of answer per query.
///
/// # Errors
/// A [`Problem`] with a pointer to the field.
pub fn plan_geometry(
    planner: &Planner<'_>,
    fit: Fit,
    queries: Option<Points>,
    request: GeometryRequest,
    purpose: Purpose,
    numbers_per_query: impl Fn(usize) -> usize,
) -> Result<Plan<GeometryWork>, Problem> {
    let mut main = planner.fit(fit, purpose)?;
    check_is_surface(&main.stored.cloud)?;
    let queries = planner.queries(queries, &mut [&mut main])?;
    let (n, m, d) = (main.n_points(), queries.n_points(), queries.dimension());
    let n_numbers = planner.check_answer(m.checked_mul(numbers_per_query(d)))?;
    let offsets = match (request.model, request.checks_curvatures) {
        (SurfaceModel::Offset, _) => Offsets::Everywhere,
        (SurfaceModel::Auto | SurfaceModel::Signature, true) => Offsets::Confirmations,
        (SurfaceModel::Auto | SurfaceModel::Signature, false) => Offsets::Rescues,
    };
    let asked = Asked::Geometry { offsets };
    let cost = Cost { work: work_price(asked, n, m, d), n_numbers, n_held: m * d };
    Ok(Plan { main, surface: None, work: GeometryWork { queries, request }, cost })
}

/// Plans an operator applied to values, with so many numbers of answer per query.
///
/// # Errors
/// A [`Problem`] with a pointer to the field.
pub fn plan_applied(
    planner: &Planner<'_>,
    fit: Fit,
    geometry: Option<Geometry>,
    values: Vec<f64>,
    queries: Option<Points>,
    numbers_per_query: impl Fn(usize) -> usize,
) -> Result<Plan<AppliedWork>, Problem> {
    let request = operator_request(&geometry);
    let (mut main, mut surface) = planner.fits(fit, geometry)?;
    check_is_surface(&main.stored.cloud)?;
    planner.check_values(&values, &main)?;
    let queries = planner.queries(queries, &mut [&mut main, &mut surface])?;
    let m = queries.n_points();
    let d = queries.dimension();
    let asked = Asked::Operator { n_surface_points: surface.n_points() };
    let cost = Cost {
        work: work_price(asked, main.n_points(), m, d),
        n_numbers: planner.check_answer(m.checked_mul(numbers_per_query(d)))?,
        n_held: main.n_points() + surface.n_points() + m * d,
    };
    Ok(Plan { main, surface: Some(surface), work: AppliedWork { values, queries, request }, cost })
}

/// Plans an operator as a matrix, with so many rows per query.
///
/// # Errors
/// A [`Problem`] with a pointer to the field.
pub fn plan_matrix(
    planner: &Planner<'_>,
    fit: Fit,
    geometry: Option<Geometry>,
    queries: Option<Points>,
    rows_per_query: impl Fn(usize) -> usize,
) -> Result<Plan<MatrixWork>, Problem> {
    let request = operator_request(&geometry);
    let (mut main, mut surface) = planner.fits(fit, geometry)?;
    check_is_surface(&main.stored.cloud)?;
    let queries = planner.queries(queries, &mut [&mut main, &mut surface])?;
    let n = main.stored.cloud.n_points();
    let (m, d) = (queries.n_points(), queries.dimension());
    let n_rows = m.checked_mul(rows_per_query(d));
    let asked =
        Asked::OperatorMatrix { n_surface_points: surface.n_points(), n_rows: n_rows.unwrap_or(usize::MAX) };
    let cost = Cost {
        n_numbers: planner.check_answer(n_rows.and_then(|rows| rows.checked_mul(n)))?,
        work: work_price(asked, n, m, d),
        n_held: m * d,
    };
    Ok(Plan { main, surface: Some(surface), work: MatrixWork { queries, request }, cost })
}

/// Operators see second derivatives of the surface, and do not depend on the side that normals point to.
fn operator_request(geometry: &Option<Geometry>) -> GeometryRequest {
    let surface = geometry.as_ref().and_then(|geometry| geometry.surface);
    geometry_request(surface, Some(OrientationChoice::Gradient), true)
}

/// What a request asks of the geometry of its surface.
pub fn geometry_request(
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
fn check_is_surface(cloud: &Cloud) -> Result<(), Problem> {
    if cloud.dimension() >= 2 {
        return Ok(());
    }
    let detail = "the geometry of a hypersurface needs points of dimension 2 or more, found 1";
    Err(Problem::of_field(Slug::InvalidCloud, "/cloud/points", detail))
}
