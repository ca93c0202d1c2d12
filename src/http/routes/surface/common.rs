//! What operations on surfaces share: checked work, its price, and its diagnostics.

use std::sync::Arc;

use crate::http::compute::JobObserver;
use crate::http::fields::{
    Degenerate, Diagnostics, Fit, Geometry, GeometryInclude, OrientationChoice, StencilsUsed, SurfaceChoice,
    ValuesInclude,
};
use crate::http::problem::Problem;
use crate::http::problem::slug::Slug;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::Plan;
use crate::http::serve::plan::{Cost, PlannedSurface, Values};
use crate::http::serve::planner::{GivenValues, OperatorFits, Planner};
use crate::http::serve::surface::SurfaceGeometry;
use crate::http::wire::read::points::Points;
use crate::store::clouds::RegisteredCloud;
use gramian_numerics::error::NumericsError;
use gramian_numerics::kernel::defaults::Purpose;
use gramian_numerics::model::Report;
use gramian_numerics::model::price::{OperatorAsked, Sizes, geometry_price, operator_price};
use gramian_numerics::observer::Observer;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::neighbours::Neighbours;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::selection::learning_price;
use gramian_numerics::solver::choose::{
    Asked, AskedOfSurface, MAX_OFFSETS, Offsets, n_entries_per_row, sampling_bytes, work_price,
};
use gramian_numerics::surface::geometry::{
    Geometry as SurfaceGeometryAtQueries, GeometryRequest, Orientation, SurfaceModel,
};
use gramian_numerics::surface::operators::{Kriged, OfKriged, SparseMatrix, Stencils};

/// A checked request for normals or curvatures.
pub struct GeometryWork {
    pub queries: Arc<Cloud>,
    pub request: GeometryRequest,
}

/// A checked request to apply an operator to values.
pub struct AppliedWork {
    pub values: Arc<Values>,
    pub queries: Arc<Cloud>,
    pub request: GeometryRequest,
}

/// What a request to apply an operator has beside its fit.
pub struct Applied {
    pub geometry: Option<Geometry>,
    pub values: Vec<f64>,
    pub queries: Option<Points>,
    pub include: Option<Vec<ValuesInclude>>,
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
        let constant = match (&fits.surface, surface.surface.signature()) {
            (None, Some(signature)) => signature.clone(),
            _ => fits.interpolant_of_one(observer)?,
        };
        let report = Report::of_function(&constant.solver, &constant.solution, 1.0);
        let mut diagnostics = fits.main.diagnostics(&report, m);
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
    let mut main = planner.surface_fit(fit, purpose, &request)?;
    check_is_surface(&main.on.stored.cloud)?;
    let queries = planner.queries(queries, &mut main.on)?;
    let (m, d) = (queries.n_points(), queries.dimension());
    let n_numbers = planner.check_answer(m.checked_mul(numbers_per_query(d)))?;
    let sizes = Sizes { n_points: main.on.n_points(), n_queries: m, dimension: d };
    let work = geometry_price(main.solver(), asked_of(&request, &main, &queries), sizes);
    let cost = Cost { work, n_numbers, n_held: m * d };
    Ok(Plan { main: main.into(), surface: None, work: GeometryWork { queries, request }, cost })
}

/// Plans an operator applied to values, with so many numbers of answer per query.
///
/// # Errors
/// A [`Problem`] with a pointer to the field.
pub fn plan_applied(
    planner: &Planner<'_>,
    fit: Fit,
    applied: Applied,
    numbers_per_query: impl Fn(usize) -> usize,
) -> Result<Plan<AppliedWork>, Problem> {
    let Applied { geometry, values, queries, include } = applied;
    let has_deviations = include.is_some_and(|include| include.contains(&ValuesInclude::Deviations));
    let request = GeometryRequest { has_deviations, ..operator_request(&geometry) };
    let OperatorFits { mut main, values, mut surface } =
        planner.operator_fits(fit, GivenValues::one(values), geometry, &request)?;
    check_is_surface(&main.on.stored.cloud)?;
    let queries = planner.queries(queries, &mut surface.on)?;
    main.on.pointers.queries = surface.on.pointers.queries;
    let (n, m, d) = (main.on.n_points(), queries.n_points(), queries.dimension());
    let n_surface_points = surface.on.n_points();
    let of_operator = m.checked_mul(numbers_per_query(d));
    let asked = OperatorAsked {
        n_surface_points,
        n_numbers: of_operator.unwrap_or(usize::MAX),
        surface: asked_of(&request, &surface, &queries),
        has_deviations,
    };
    let sizes = Sizes { n_points: n, n_queries: m, dimension: d };
    let mut work = operator_price(main.solver, surface.solver(), asked, sizes).and(learning_price(n, d, 1));
    // Where the kernel stretches the cloud or duplicates are merged, it is another cloud.
    work.n_bytes = work.n_bytes.saturating_add(sampling_bytes(n, d));
    let n_lists = if has_deviations { 2 } else { 1 };
    let n_numbers = planner.check_answer(of_operator.and_then(|n| n.checked_mul(n_lists)))?;
    let cost = Cost { work, n_numbers, n_held: n + n_surface_points + m * d };
    let work = AppliedWork { values, queries, request };
    Ok(Plan { main: main.into(), surface: Some(surface.into()), work, cost })
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
    let (mut main, mut surface) = planner.matrix_fits(fit, geometry, &request)?;
    check_is_surface(&main.on.stored.cloud)?;
    let queries = planner.queries(queries, &mut surface.on)?;
    main.on.pointers.queries = surface.on.pointers.queries;
    let n = main.on.n_points();
    let (m, d) = (queries.n_points(), queries.dimension());
    let n_rows = m.checked_mul(rows_per_query(d));
    let asked = Asked::OperatorMatrix {
        n_surface_points: surface.on.n_points(),
        n_rows: n_rows.unwrap_or(usize::MAX),
        surface: asked_of(&request, &surface, &queries),
    };
    let cost = Cost {
        n_numbers: planner.check_answer(n_rows.and_then(|rows| rows.checked_mul(n)))?,
        work: work_price(asked, n, m, d),
        n_held: m * d,
    };
    let work = MatrixWork { queries, request };
    Ok(Plan { main: main.into(), surface: Some(surface.into()), work, cost })
}

/// Checked work of an operator as a sparse matrix.
pub struct StencilWork {
    pub nodes: Arc<RegisteredCloud>,
    pub queries: Arc<Cloud>,
    pub request: GeometryRequest,
}

/// One of the operators as a sparse matrix.
type Assemble = fn(
    &SurfaceGeometryAtQueries,
    &Cloud,
    &Neighbours,
    &Cloud,
    &dyn Observer,
) -> Result<Stencils, NumericsError>;

impl StencilWork {
    /// The matrix; queries that its nodes do not resolve are flagged.
    ///
    /// # Errors
    /// Those of the numerics as a [`Problem`].
    pub fn matrix(
        &self,
        fits: &Fits,
        surface: &mut SurfaceGeometry,
        assemble: Assemble,
        observer: &JobObserver,
    ) -> Result<SparseMatrix, Problem> {
        matrix_of(fits, surface, (&self.nodes.cloud, &self.queries), assemble, observer)
    }
}

/// One of the operators on values that are kriged around each query.
type OnKriged =
    fn(&SurfaceGeometryAtQueries, Kriged<'_>, &Cloud, &dyn Observer) -> Result<OfKriged, NumericsError>;

/// An operator on values that were kriged around each query.
pub struct KrigedAnswer {
    /// `[m, k]`.
    pub values: Vec<f64>,
    /// Likewise, if asked for.
    pub deviations: Option<Vec<f64>>,
    pub degenerate: Vec<Degenerate>,
    pub diagnostics: Diagnostics,
}

impl AppliedWork {
    /// The surface at the queries, of which those are flagged that are far from the nodes of the values.
    ///
    /// # Errors
    /// Those of [`Fits::geometry`].
    pub fn surface(&self, fits: &Fits, observer: &JobObserver) -> Result<SurfaceGeometry, Problem> {
        let mut surface = fits.geometry(&self.queries, &self.request, observer)?;
        let nodes = &fits.main.plan.stored;
        if fits.surface().plan.stored.id != nodes.id {
            let sampling = match nodes.sampling() {
                Some(sampling) => sampling.clone(),
                None => {
                    Arc::new(Sampling::of(&nodes.cloud, observer).map_err(|error| fits.main.refused(error))?)
                }
            };
            surface.geometry.flag_far_from(&sampling, &self.queries);
        }
        Ok(surface)
    }

    /// An operator on the values where they are kriged around each query; `None` where one solver serves all.
    ///
    /// # Errors
    /// Those of the numerics as a [`Problem`].
    pub fn by_kriging(
        &self,
        fits: &Fits,
        surface: &SurfaceGeometry,
        operator: OnKriged,
        observer: &JobObserver,
    ) -> Result<Option<KrigedAnswer>, Problem> {
        let Some(moving) = fits.main.model().kriging() else { return Ok(None) };
        let refused = |error| fits.main.refused(error);
        let (plan, values) = (&fits.main.plan, fits.main.plan.merged(&self.values.list));
        let (trend, factor) = (plan.trend(), plan.process.scale);
        let function = Kriged { moving, values: &values, trend, factor };
        let found = operator(&surface.geometry, function, &self.queries, observer).map_err(refused)?;
        let mut degenerate = surface.degenerate();
        surface.flag_uncertain(Ok(found.uncertain), &mut degenerate).map_err(refused)?;
        let report = Report {
            trend: trend.cloned(),
            n_neighbours: moving.n_neighbours(),
            n_dependent: found.n_dependent,
            ..Report::default()
        };
        let mut diagnostics = fits.main.diagnostics(&report, self.queries.n_points());
        fits.main.warn_of_misfit(&mut diagnostics, None, self.request.has_deviations);
        diagnostics.geometry = Some(Box::new(surface.diagnostics(fits)));
        let deviations = self.request.has_deviations.then_some(found.deviations);
        Ok(Some(KrigedAnswer { values: found.values, deviations, degenerate, diagnostics }))
    }
}

/// An operator at queries over nodes; queries that the nodes do not resolve are flagged.
fn matrix_of(
    fits: &Fits,
    surface: &mut SurfaceGeometry,
    (nodes, queries): (&Cloud, &Cloud),
    assemble: Assemble,
    observer: &JobObserver,
) -> Result<SparseMatrix, Problem> {
    let of = |neighbours: &Neighbours| assemble(&surface.geometry, nodes, neighbours, queries, observer);
    let found = match surface.surface.cloud() == nodes {
        // Known already where the nodes are the points of the surface.
        true => of(surface.surface.neighbours()),
        false => Neighbours::of(nodes, observer).and_then(|neighbours| of(&neighbours)),
    };
    let found = found.map_err(|error| fits.surface().refused(error))?;
    surface.geometry.take_resolutions(&found.resolutions);
    surface.stencils = Some(StencilsUsed::of(&found));
    Ok(found.matrix)
}

/// Plans an operator as a sparse matrix.
///
/// # Errors
/// Those of the planner.
pub fn plan_stencils(
    planner: &Planner<'_>,
    fit: Fit,
    geometry: Option<Geometry>,
    queries: Option<Points>,
    n_components: impl Fn(usize) -> usize,
) -> Result<Plan<StencilWork>, Problem> {
    let request = operator_request(&geometry);
    let (nodes, mut main) = planner.stencils(fit, geometry, &request)?;
    check_is_surface(&main.on.stored.cloud)?;
    let queries = planner.queries(queries, &mut main.on)?;
    let (m, d) = (queries.n_points(), queries.dimension());
    let n_entries = m.checked_mul(n_entries_per_row(d)).and_then(|n| n.checked_mul(1 + n_components(d)));
    let cost = Cost {
        work: work_price(Asked::Stencils, nodes.cloud.n_points(), m, d),
        n_numbers: planner.check_answer(n_entries)?,
        n_held: m * d,
    };
    let work = StencilWork { nodes, queries, request };
    Ok(Plan { main: main.into(), surface: None, work, cost })
}

/// Operators see second derivatives of the surface, and do not depend on the side that normals point to.
fn operator_request(geometry: &Option<Geometry>) -> GeometryRequest {
    let surface = geometry.as_ref().and_then(|geometry| geometry.surface);
    geometry_request(surface, Some(OrientationChoice::Gradient), true, None)
}

/// What a request asks of the geometry of its surface.
pub fn geometry_request(
    surface: Option<SurfaceChoice>,
    orientation: Option<OrientationChoice>,
    checks_curvatures: bool,
    include: Option<&[GeometryInclude]>,
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
            SurfaceChoice::Local => SurfaceModel::Local,
        },
        checks_curvatures,
        max_offsets: MAX_OFFSETS,
        has_deviations: include.is_some_and(|include| include.contains(&GeometryInclude::Deviations)),
    }
}

/// What a request takes of its surface, as far as its price goes.
fn asked_of(request: &GeometryRequest, surface: &PlannedSurface, queries: &Cloud) -> AskedOfSurface {
    let offsets = match (request.model, request.checks_curvatures) {
        (SurfaceModel::Offset, _) => Offsets::Everywhere,
        (SurfaceModel::Auto | SurfaceModel::Signature | SurfaceModel::Local, true) => Offsets::Confirmations,
        (SurfaceModel::Auto | SurfaceModel::Signature | SurfaceModel::Local, false) => Offsets::Rescues,
    };
    let are_points = *queries == *surface.on.stored.cloud;
    AskedOfSurface {
        offsets,
        has_own_quadrics: request.checks_curvatures && !are_points,
        has_deviations: request.has_deviations,
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
