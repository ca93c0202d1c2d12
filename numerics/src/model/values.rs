//! Functions through values, evaluated at queries by the solver of the model.

use super::{Model, Report};
use crate::error::{NumericsError, Quantity, Result};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::regression::function::batch::{Batch, BatchJets};
use crate::regression::function::deviations::JetDeviations;
use crate::regression::function::interpolant::Interpolant;
use crate::regression::function::local_kriging::{KrigingRequest, LocalKriging};
use crate::regression::function::posterior::{Variances, variances_with_mean};
use crate::regression::solver::EarlierSolutions;
use crate::regression::solver::trend::{Mean, Trend};
use crate::regression::sums::jets::{JetOrder, Jets};

/// Values at the fitted points, with the known parameters of their process.
#[derive(Clone, Copy)]
pub struct FittedValues<'a> {
    /// Shape `[n]`, unit V. With k lists, each with a function of its own, shape `[k, n]`.
    pub values: &'a [f64],
    pub mean: Mean,
    /// Mean learned from the values, for solvers that never see all of them at once.
    pub trend: Option<&'a Trend>,
    /// Ratio of kernel and noise to those of the model, unit V².
    pub scale: f64,
}

/// Quantities requested at queries.
#[derive(Clone, Copy)]
pub struct JetRequest<'a> {
    /// `[m, d]`, unit L.
    pub queries: &'a Cloud,
    pub order: JetOrder,
    pub has_variances: bool,
    /// Order up to which deviations of value and derivatives are requested.
    pub deviations: Option<JetOrder>,
}

/// A function evaluated at queries, with its uncertainty.
pub struct ValuesAt {
    pub jets: Jets,
    /// Present if requested.
    pub variances: Option<Variances>,
    /// Present if requested.
    pub deviations: Option<JetDeviations>,
    pub report: Report,
    /// The function, if a single one serves all queries.
    pub interpolant: Option<Interpolant>,
}

/// k functions evaluated at queries, with the uncertainty that they share.
pub struct EachAt {
    pub jets: BatchJets,
    /// Present if requested.
    pub variances: Option<Variances>,
    /// Present if requested.
    pub deviations: Option<JetDeviations>,
    /// Report of the solver, with the residual of the worst list and the disagreement of the first that has
    /// one.
    pub report: Report,
    pub batch: Batch,
}

impl Model {
    /// Returns the function with these values, evaluated at queries. `known` holds its weights, or
    /// those of other values, if solved before.
    ///
    /// # Errors
    /// Returns the errors of [`Interpolant::fit_with_mean`] and [`Interpolant::at`], or of
    /// [`LocalKriging::at`], and those of the requested variances and deviations. Returns
    /// [`NumericsError::Unsupported`] for local regressions.
    pub fn values_at(
        &self,
        fitted: FittedValues<'_>,
        request: JetRequest<'_>,
        known: EarlierSolutions,
        observer: &dyn Observer,
    ) -> Result<ValuesAt> {
        match self {
            Self::System(_) => {
                let interpolant = self.interpolant(fitted.values, fitted.mean, known, observer)?;
                of_one_function(interpolant, fitted.scale, request, observer)
            }
            Self::LocalKriging(moving) => around_queries(moving, fitted, request, observer),
            Self::LocalSurface => Err(self.lacks(Quantity::Values)),
        }
    }

    /// Returns the functions with these lists of values `[k, n]`, k ≥ 1, evaluated at queries.
    ///
    /// # Errors
    /// Returns the errors of [`Batch::fit`] and [`Batch::at`], and those of the requested variances and
    /// deviations. Returns [`NumericsError::Unsupported`] where each query has a function of its own.
    pub fn each_at(
        &self,
        fitted: FittedValues<'_>,
        request: JetRequest<'_>,
        observer: &dyn Observer,
    ) -> Result<EachAt> {
        let batch = Batch::fit(self.solver()?.clone(), fitted.values, fitted.mean, observer)?;
        let jets = batch.at(request.queries, request.order, observer)?;
        let report = |interpolant: &Interpolant| {
            Report::of_function(&interpolant.solver, &interpolant.solution, fitted.scale)
        };
        let worse = |a: &Interpolant, b: &Interpolant| {
            a.solution.relative_residual.total_cmp(&b.solution.relative_residual)
        };
        let expected = NumericsError::LengthMismatch { expected: batch.solver.n_points(), found: 0 };
        let worst = batch.interpolants().max_by(worse).ok_or(expected)?;
        let (variances, deviations) = uncertainty(&worst, fitted.scale, request, observer)?;
        // Norm, misfit and mean differ from list to list.
        let report = Report {
            native_norm_squared: None,
            misfit: None,
            trend: None,
            disagreement: batch.interpolants().find_map(|of| report(&of).disagreement),
            ..report(&worst)
        };
        Ok(EachAt { jets, variances, deviations, report, batch })
    }
}

fn of_one_function(
    interpolant: Interpolant,
    scale: f64,
    request: JetRequest<'_>,
    observer: &dyn Observer,
) -> Result<ValuesAt> {
    let jets = interpolant.at(request.queries, request.order, observer)?;
    let (variances, deviations) = uncertainty(&interpolant, scale, request, observer)?;
    let report = Report::of_function(&interpolant.solver, &interpolant.solution, scale);
    Ok(ValuesAt { jets, variances, deviations, report, interpolant: Some(interpolant) })
}

/// Returns the requested variances and deviations. All functions with one mean on one cloud have the same
/// ones.
fn uncertainty(
    function: &Interpolant,
    scale: f64,
    request: JetRequest<'_>,
    observer: &dyn Observer,
) -> Result<(Option<Variances>, Option<JetDeviations>)> {
    let Interpolant { solver, solution } = function;
    let variances = || {
        let found = variances_with_mean(solver, solution.trend.as_ref(), request.queries, observer);
        found.map(|found| found.scaled(scale))
    };
    let deviations =
        |order: JetOrder| JetDeviations::of(function, scale, request.queries, order.degree(), observer);
    let variances = request.has_variances.then(variances).transpose()?;
    Ok((variances, request.deviations.map(deviations).transpose()?))
}

fn around_queries(
    moving: &LocalKriging,
    fitted: FittedValues<'_>,
    asked: JetRequest<'_>,
    observer: &dyn Observer,
) -> Result<ValuesAt> {
    let FittedValues { values, trend, scale, .. } = fitted;
    // Only computed derivatives have deviations, so the order is raised to that of the deviations.
    let order = asked.deviations.filter(|of| of.degree() > asked.order.degree()).unwrap_or(asked.order);
    let request = KrigingRequest {
        order,
        has_variances: asked.has_variances,
        has_deviations: asked.deviations.is_some(),
        trend,
    };
    let found = moving.at(values, asked.queries, request, observer)?;
    let report = Report {
        trend: trend.cloned(),
        n_neighbours: moving.n_neighbours(),
        n_dependent: found.n_dependent,
        unsettled: moving.unsettled(values, asked.queries, trend, observer)?,
        ..Report::default()
    };
    Ok(ValuesAt {
        jets: found.jets,
        variances: found.variances.map(|variances| variances.scaled(scale)),
        deviations: found.deviations.map(|deviations| deviations.scaled(scale)),
        report,
        interpolant: None,
    })
}
