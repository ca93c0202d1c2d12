//! Code shared by all operators over a surface: planning, price, answers and diagnostics.

use std::sync::Arc;

use super::common::{asked_of, check_is_surface, geometry_request};
use super::doubts::{DoubtfulAnswers, flags};
use crate::http::fields::{
    Diagnostics, Fit, Flag, OrientationChoice, StencilCounts, Surface, ValueAttribute,
};
use crate::http::problem::Problem;
use crate::http::serve::answers::surface::SurfaceGeometry;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::Plan;
use crate::http::serve::plan::{Cost, Values};
use crate::http::serve::planner::{GivenValues, OperatorFits, Planner};
use crate::store::clouds::RegisteredCloud;
use gramian_host::compute::JobObserver;
use gramian_host::wire::read::points::Points;
use gramian_host::wire::write::array::Array;
use gramian_host::wire::write::integers::Integers;
use gramian_numerics::machine::price::Sizes;
use gramian_numerics::model::Report;
use gramian_numerics::model::price::{OperatorAsked, operator_price};
use gramian_numerics::operators::price::{matrix_price, n_entries_per_row, stencils_price};
use gramian_numerics::operators::{KrigedFunction, OfKriged, Operator, OperatorAnswers, SparseMatrix};
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::neighbours::Neighbours;
use gramian_numerics::points::sampling::{Sampling, sampling_price};
use gramian_numerics::regression::function::local_kriging::LocalKriging;
use gramian_numerics::regression::selection::learning_price;
use gramian_numerics::surface::geometry::GeometryRequest;

/// A checked request to apply an operator to values.
pub struct AppliedWork {
    values: Arc<Values>,
    queries: Arc<Cloud>,
    request: GeometryRequest,
}

/// The parts of a request to apply an operator that are not its fit.
pub struct OperatorParts {
    pub surface: Option<Surface>,
    pub values: Vec<f64>,
    pub queries: Option<Points>,
    pub include: Option<Vec<ValueAttribute>>,
}

/// A checked request for an operator as a matrix.
pub struct MatrixWork {
    queries: Arc<Cloud>,
    request: GeometryRequest,
}

/// A checked request for an operator as a sparse matrix.
pub struct StencilWork {
    nodes: Arc<RegisteredCloud>,
    queries: Arc<Cloud>,
    request: GeometryRequest,
}

/// An operator applied to values, at queries.
pub struct AppliedAnswer {
    /// The operator at each query: `[m]` for Laplace–Beltrami, `[m, d]` for the surface gradient.
    pub values: Array,
    /// Standard deviations in the shape of `values`, if they are requested.
    pub deviations: Option<Array>,
    pub flags: Vec<Flag>,
    pub diagnostics: Diagnostics,
}

/// An operator as a matrix: `[m, n]`, or `[d, m, n]` with a matrix per component.
pub struct MatrixAnswer {
    pub matrix: Array,
    pub flags: Vec<Flag>,
    pub diagnostics: Diagnostics,
}

/// An operator as compressed sparse rows. All components have their entries at the same places.
pub struct SparseAnswer {
    /// `[m, n]` or `[d, m, n]`.
    pub shape: Integers,
    pub indptr: Integers,
    pub indices: Integers,
    /// A number per entry. For several components, a row of such numbers per component.
    pub data: Array,
    pub flags: Vec<Flag>,
    pub diagnostics: Diagnostics,
}

impl AppliedWork {
    /// Plans an operator applied to values.
    ///
    /// # Errors
    /// Returns a [`Problem`] with a pointer to the field.
    pub fn plan(
        planner: &Planner<'_>,
        operator: Operator,
        fit: Fit,
        applied: OperatorParts,
    ) -> Result<Plan<Self>, Problem> {
        let OperatorParts { surface: given, values, queries, include } = applied;
        let has_deviations = include.is_some_and(|include| include.contains(&ValueAttribute::Std));
        let request = GeometryRequest { has_deviations, ..operator_request(&given) };
        let OperatorFits { mut main, values, mut surface } =
            planner.operator_fits(fit, GivenValues::one(values), given, &request)?;
        check_is_surface(&main.on.stored.cloud)?;
        let queries = planner.queries(queries, &mut surface.on)?;
        main.on.pointers.queries = surface.on.pointers.queries;
        let (n, m, d) = (main.on.n_points(), queries.n_points(), queries.dimension());
        let n_surface_points = surface.on.n_points();
        let of_operator = m.checked_mul(operator.n_components(d));
        let asked = OperatorAsked {
            n_surface_points,
            n_numbers: of_operator.unwrap_or(usize::MAX),
            surface: asked_of(&request, &surface, &queries),
            has_deviations,
        };
        let sizes = Sizes { n_points: n, n_queries: m, dimension: d };
        let mut work = operator_price(main.solver, surface.solver(), asked, sizes)
            .and(learning_price(&main.on.stored.cloud, 1));
        // A cloud that the kernel stretches, or whose duplicates are merged, has to be sampled for itself.
        work.n_bytes = work.n_bytes.saturating_add(sampling_price(n, d).n_bytes);
        let n_lists = if has_deviations { 2 } else { 1 };
        let n_numbers = planner.check_answer(of_operator.and_then(|n| n.checked_mul(n_lists)))?;
        let cost = Cost { work, n_numbers, n_held: n + n_surface_points + m * d };
        let work = Self { values, queries, request };
        Ok(Plan::on_surface(main, surface, work, cost))
    }

    /// Applies the operator to the function through all values, or to functions that are kriged around each
    /// query.
    ///
    /// # Errors
    /// Returns errors of the numerics as a [`Problem`].
    pub fn apply(
        &self,
        operator: Operator,
        fits: &Fits,
        observer: &JobObserver,
    ) -> Result<AppliedAnswer, Problem> {
        let applying = Applying { work: self, operator, fits, surface: self.surface(fits, observer)? };
        match fits.main.model().kriging() {
            Some(moving) => applying.by_kriging(moving, observer),
            None => applying.by_one_function(observer),
        }
    }

    /// Computes the surface at the queries. Flags queries that are far from the nodes of the values.
    fn surface(&self, fits: &Fits, observer: &JobObserver) -> Result<SurfaceGeometry, Problem> {
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
}

/// An operator that is being applied to the values of a request.
struct Applying<'a> {
    work: &'a AppliedWork,
    operator: Operator,
    fits: &'a Fits,
    surface: SurfaceGeometry,
}

/// Results of an operator at the queries, with deviations, flags and a report.
struct OperatorResult {
    values: Vec<f64>,
    deviations: Option<Vec<f64>>,
    flags: Vec<Flag>,
    report: Report,
}

impl Applying<'_> {
    fn by_one_function(&self, observer: &JobObserver) -> Result<AppliedAnswer, Problem> {
        let Self { work, operator, fits, surface } = self;
        let refused = |error| fits.main.refused(error);
        let (geometry, queries) = (&surface.geometry, &*work.queries);
        let factor = fits.main.plan.process.scale;
        let interpolant = &fits.interpolant(&work.values, observer)?;
        let values = operator.apply(geometry, interpolant, queries, observer).map_err(refused)?;
        let deviations = || operator.deviations(geometry, interpolant, factor, queries, observer);
        let deviations = work.request.has_deviations.then(deviations).transpose().map_err(refused)?;
        let judged =
            OperatorAnswers { geometry, interpolant, factor, queries, found: &values, learned: None };
        let doubted = DoubtfulAnswers {
            operator: *operator,
            judged,
            values: &work.values.list,
            deviations: deviations.as_deref(),
        };
        let flags = flags(doubted, fits, surface, observer)?;
        let report = Report::of_function(&interpolant.solver, &interpolant.solution, factor);
        Ok(self.answer(OperatorResult { values, deviations, flags, report }))
    }

    fn by_kriging(&self, moving: &LocalKriging, observer: &JobObserver) -> Result<AppliedAnswer, Problem> {
        let Self { work, operator, fits, surface } = self;
        let refused = |error| fits.main.refused(error);
        let plan = &fits.main.plan;
        let merged = plan.merged(&work.values.list);
        let (trend, factor) = (plan.trend(), plan.process.scale);
        let function = KrigedFunction { moving, values: &merged, trend, factor };
        let found = operator.on_kriged(&surface.geometry, function, &work.queries, observer);
        let OfKriged { values, deviations, uncertain, n_dependent } = found.map_err(refused)?;
        let mut flags = surface.flags();
        surface.flag_uncertain(Ok(uncertain), &mut flags).map_err(refused)?;
        let report = Report {
            trend: trend.cloned(),
            n_neighbours: moving.n_neighbours(),
            n_dependent,
            ..Report::default()
        };
        let deviations = work.request.has_deviations.then_some(deviations);
        Ok(self.answer(OperatorResult { values, deviations, flags, report }))
    }

    fn answer(&self, found: OperatorResult) -> AppliedAnswer {
        let Self { work, operator, fits, surface } = self;
        let OperatorResult { values, deviations, flags, report } = found;
        let (m, d) = (work.queries.n_points(), work.queries.dimension());
        let shape = match operator {
            Operator::LaplaceBeltrami => vec![m],
            Operator::SurfaceGradient => vec![m, d],
        };
        let mut diagnostics = fits.main.diagnostics(&report, m);
        fits.main.warn_of_poor_fit(&mut diagnostics, report.disagreement, work.request.has_deviations);
        diagnostics.surface = Some(Box::new(surface.diagnostics(fits)));
        AppliedAnswer {
            values: surface.per_query(values, &shape),
            deviations: deviations.map(|deviations| surface.known_per_query(deviations, &shape)),
            flags,
            diagnostics,
        }
    }
}

impl MatrixWork {
    /// Plans an operator as a matrix.
    ///
    /// # Errors
    /// Returns a [`Problem`] with a pointer to the field.
    pub fn plan(
        planner: &Planner<'_>,
        operator: Operator,
        fit: Fit,
        surface: Option<Surface>,
        queries: Option<Points>,
    ) -> Result<Plan<Self>, Problem> {
        let request = operator_request(&surface);
        let (mut main, mut surface) = planner.matrix_fits(fit, surface, &request)?;
        check_is_surface(&main.on.stored.cloud)?;
        let queries = planner.queries(queries, &mut surface.on)?;
        main.on.pointers.queries = surface.on.pointers.queries;
        let (n, m, d) = (main.on.n_points(), queries.n_points(), queries.dimension());
        let n_rows = m.checked_mul(operator.n_components(d));
        let sizes = Sizes { n_points: n, n_queries: m, dimension: d };
        let of_surface = asked_of(&request, &surface, &queries);
        let work = matrix_price(n_rows.unwrap_or(usize::MAX), surface.on.n_points(), of_surface, sizes);
        let cost = Cost {
            n_numbers: planner.check_answer(n_rows.and_then(|rows| rows.checked_mul(n)))?,
            work,
            n_held: m * d,
        };
        let work = Self { queries, request };
        Ok(Plan::on_surface(main, surface, work, cost))
    }

    /// Computes the matrix, with a column for each point of the client's cloud.
    ///
    /// # Errors
    /// Returns errors of the numerics as a [`Problem`].
    pub fn matrix(
        &self,
        operator: Operator,
        fits: &Fits,
        observer: &JobObserver,
    ) -> Result<MatrixAnswer, Problem> {
        let refused = |error| fits.main.refused(error);
        let surface = fits.geometry(&self.queries, &self.request, observer)?;
        let (geometry, mean) = (&surface.geometry, fits.main.plan.process.mean);
        let solver = fits.main.model().solver().map_err(refused)?;
        let matrix = operator.matrix(geometry, solver, &self.queries, mean, observer).map_err(refused)?;
        let (m, n) = (geometry.n_queries(), fits.main.plan.stored.cloud.n_points());
        let (shape, axis_of_queries) = match operator {
            Operator::LaplaceBeltrami => (vec![m, n], 0),
            Operator::SurfaceGradient => (vec![geometry.dimension(), m, n], 1),
        };
        let matrix = Array::new(fits.main.unmerge(matrix), &shape);
        Ok(MatrixAnswer {
            matrix: matrix.with_nulls(axis_of_queries, geometry.is_null()),
            flags: surface.flags(),
            diagnostics: self.diagnostics(fits, &surface, observer)?,
        })
    }

    /// Returns the diagnostics of the main fit and of the surface. Without values, the quality of the main
    /// fit is that of Y = 1.
    fn diagnostics(
        &self,
        fits: &Fits,
        surface: &SurfaceGeometry,
        observer: &JobObserver,
    ) -> Result<Diagnostics, Problem> {
        let constant = match (&fits.surface, surface.surface.signature()) {
            (None, Some(signature)) => signature.clone(),
            _ => fits.interpolant_of_one(observer)?,
        };
        let report = Report::of_function(&constant.solver, &constant.solution, 1.0);
        let mut diagnostics = fits.main.diagnostics(&report, self.queries.n_points());
        diagnostics.surface = Some(Box::new(surface.diagnostics(fits)));
        Ok(diagnostics)
    }
}

impl StencilWork {
    /// Plans an operator as a sparse matrix.
    ///
    /// # Errors
    /// Returns the errors of the planner.
    pub fn plan(
        planner: &Planner<'_>,
        operator: Operator,
        fit: Fit,
        surface: Option<Surface>,
        queries: Option<Points>,
    ) -> Result<Plan<Self>, Problem> {
        let request = operator_request(&surface);
        let (nodes, mut main) = planner.stencils(fit, surface, &request)?;
        check_is_surface(&main.on.stored.cloud)?;
        let queries = planner.queries(queries, &mut main.on)?;
        let (m, d) = (queries.n_points(), queries.dimension());
        // Each entry has a column index, which all components share, and a number per component.
        let per_entry = 1 + operator.n_components(d);
        let n_numbers = m.checked_mul(n_entries_per_row(d)).and_then(|n| n.checked_mul(per_entry));
        let cost = Cost {
            work: stencils_price(Sizes { n_points: nodes.cloud.n_points(), n_queries: m, dimension: d }),
            n_numbers: planner.check_answer(n_numbers)?,
            n_held: m * d,
        };
        let work = Self { nodes, queries, request };
        Ok(Plan::of_surface(main, work, cost))
    }

    /// Assembles the matrix. Flags queries around which its nodes do not resolve the surface.
    ///
    /// # Errors
    /// Returns errors of the numerics as a [`Problem`].
    pub fn matrix(
        &self,
        operator: Operator,
        fits: &Fits,
        observer: &JobObserver,
    ) -> Result<SparseAnswer, Problem> {
        let mut surface = fits.geometry(&self.queries, &self.request, observer)?;
        let (nodes, queries) = (&*self.nodes.cloud, &*self.queries);
        let of = |neighbours: &Neighbours| {
            operator.stencils(&surface.geometry, nodes, neighbours, queries, observer)
        };
        let found = if surface.surface.cloud() == nodes {
            // The neighbours of the points of the surface are known already.
            of(surface.surface.neighbours())
        } else {
            Neighbours::of(nodes, observer).and_then(|neighbours| of(&neighbours))
        };
        let found = found.map_err(|error| fits.surface().refused(error))?;
        surface.geometry.take_resolutions(&found.resolutions);
        surface.stencils = Some(StencilCounts::of(&found));
        let SparseMatrix { indptr, indices, data, .. } = found.matrix;
        let (m, n, d) = (queries.n_points(), nodes.n_points(), queries.dimension());
        let (shape, of_data) = match operator {
            Operator::LaplaceBeltrami => (vec![m, n], vec![indices.len()]),
            Operator::SurfaceGradient => (vec![d, m, n], vec![d, indices.len()]),
        };
        Ok(SparseAnswer {
            shape: Integers::new(shape.into_iter().map(|side| side as i64).collect()),
            indptr: Integers::new(indptr),
            indices: Integers::new(indices),
            data: Array::new(data, &of_data),
            flags: surface.flags(),
            diagnostics: surface.diagnostics(fits),
        })
    }
}

/// Returns the request for the surface of an operator.
///
/// Operators use second derivatives of the surface, so curvatures are checked. They do not depend on the side
/// that normals point to, so normals just follow the gradient.
fn operator_request(surface: &Option<Surface>) -> GeometryRequest {
    let model = surface.as_ref().and_then(|surface| surface.model);
    geometry_request(model, Some(OrientationChoice::Gradient), true, None)
}
