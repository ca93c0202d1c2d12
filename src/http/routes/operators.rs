//! What the surface gradient and the Laplace–Beltrami operator share: checked work, and its diagnostics.

use std::sync::Arc;

use super::surface::{check_is_surface, geometry_request, numbers_at_query};
use crate::http::compute::JobObserver;
use crate::http::fields::{Diagnostics, Fit, Geometry, OrientationChoice};
use crate::http::problem::Problem;
use crate::http::serve::fitted::{Fits, SurfaceGeometry};
use crate::http::serve::operation::Plan;
use crate::http::serve::plan::Cost;
use crate::http::serve::planner::Planner;
use crate::http::wire::read::points::Points;
use crate::numerics::points::cloud::Cloud;
use crate::numerics::surface::geometry::GeometryRequest;

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
    let n = main.n_points() + surface.n_points();
    let cost = Cost {
        flops: 60.0 * n as f64 * (n + m) as f64,
        n_numbers: planner.check_answer(m.checked_mul(numbers_per_query(d)))?,
        n_scratch: 8 * n + (numbers_at_query(d) + 1 + d + d * d) * m,
        n_held: n + m * d,
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
    let cost = Cost {
        n_numbers: planner.check_answer(n_rows.and_then(|rows| rows.checked_mul(n)))?,
        flops: 2.0 * (n as f64).powi(2) * n_rows.unwrap_or(0) as f64,
        n_scratch: 8 * n + numbers_at_query(d) * m,
        n_held: m * d,
    };
    Ok(Plan { main, surface: Some(surface), work: MatrixWork { queries, request }, cost })
}

/// Operators see second derivatives of the surface, and do not depend on the side that normals point to.
fn operator_request(geometry: &Option<Geometry>) -> GeometryRequest {
    let surface = geometry.as_ref().and_then(|geometry| geometry.surface);
    geometry_request(surface, Some(OrientationChoice::Gradient), true)
}
