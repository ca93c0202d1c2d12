//! Values at queries, from whichever solver the fit has.

use std::borrow::Cow;
use std::sync::Arc;

use super::fitted::Fits;
use crate::http::compute::JobObserver;
use crate::http::fields::Diagnostics;
use crate::http::problem::Problem;
use crate::http::wire::write::array::Array;
use gramian_numerics::function::batch::{Batch, BatchJets};
use gramian_numerics::function::deviations::JetDeviations;
use gramian_numerics::function::interpolant::Interpolant;
use gramian_numerics::function::moving::{Moving, MovingRequest};
use gramian_numerics::function::posterior::{Variances, variances_with_mean};
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::solver::Solution;
use gramian_numerics::solver::trend::Trend;
use gramian_numerics::sums::jets::{JetOrder, Jets};

/// A function at queries, and how sure it is.
pub struct ValuesAt {
    pub jets: Jets,
    /// If asked for.
    pub variances: Option<Variances>,
    /// If asked for.
    pub deviations: Option<JetDeviations>,
    pub diagnostics: Diagnostics,
    /// The function, where there is one for all queries.
    pub interpolant: Option<Interpolant>,
}

/// k functions at queries, and how sure all of them are.
pub struct EachAt {
    pub jets: BatchJets,
    /// If asked for.
    pub variances: Option<Variances>,
    /// If asked for.
    pub deviations: Option<JetDeviations>,
    pub diagnostics: Diagnostics,
    pub batch: Batch,
}

impl EachAt {
    /// `[k, p]`; none where the functions have no mean.
    pub fn mean_coefficients(batch: &Batch) -> Option<Array> {
        let trends =
            batch.solutions.iter().map(|solution| solution.trend.as_ref().map(Trend::of_coordinates));
        let rows: Vec<Vec<f64>> = trends.collect::<Option<_>>()?;
        let width = rows.first()?.len();
        Some(Array::new(rows.concat(), &[rows.len(), width]))
    }
}

/// What is asked at queries.
#[derive(Clone, Copy)]
pub struct ValuesRequest<'a> {
    /// One per point of the request's cloud; so many lists of them where each has a function of its own.
    pub values: &'a [f64],
    pub queries: &'a Cloud,
    pub order: JetOrder,
    pub has_variances: bool,
    /// Deviations of value and derivatives that are wanted, up to these.
    pub deviations: Option<JetOrder>,
}

fn has_deviations(asked: ValuesRequest<'_>) -> bool {
    asked.has_variances || asked.deviations.is_some()
}

impl Fits {
    /// The function with these values at queries.
    ///
    /// # Errors
    /// What the numerics refuses as a [`Problem`].
    pub fn values_at(&self, asked: ValuesRequest<'_>, observer: &JobObserver) -> Result<ValuesAt, Problem> {
        match self.main.stored.of_queries() {
            Some(moving) => self.around_queries(moving, asked, observer),
            None => self.of_one_function(asked, observer),
        }
    }

    /// The functions with these lists of values at queries.
    ///
    /// # Errors
    /// What the numerics refuses as a [`Problem`].
    pub fn each_at(&self, asked: ValuesRequest<'_>, observer: &JobObserver) -> Result<EachAt, Problem> {
        let refused = |error| self.main.refused(error);
        let n = self.main.plan.stored.cloud.n_points();
        let values: Cow<'_, [f64]> = match &self.main.plan.merge {
            None => Cow::Borrowed(asked.values),
            Some(merge) => asked.values.chunks_exact(n).flat_map(|list| merge.mean(list)).collect(),
        };
        let solver = self.main.solver()?.clone();
        let batch = Batch::fit(solver, &values, self.main.plan.mean, observer).map_err(refused)?;
        let jets = batch.at(asked.queries, asked.order, observer).map_err(refused)?;
        let worst = batch.solutions.iter().max_by(|a, b| a.relative_residual.total_cmp(&b.relative_residual));
        let worst = worst.ok_or_else(Problem::internal)?;
        let variances = match asked.has_variances {
            false => None,
            true => {
                let found = variances_with_mean(&batch.solver, worst.trend.as_ref(), asked.queries, observer);
                Some(found.map_err(refused)?.scaled(self.main.plan.scale))
            }
        };
        let any = batch.interpolants().next().ok_or_else(Problem::internal)?;
        let deviations = self.deviations(&any, asked, observer)?;
        let mut diagnostics = self.main.diagnostics(worst, asked.queries.n_points())?;
        let disagrees = |solution: &&Arc<Solution>| {
            solution.disagreement(batch.solver.n_points(), self.main.plan.scale).is_some()
        };
        if let Some(solution) = batch.solutions.iter().find(disagrees) {
            self.main.warn_of_misfit(&mut diagnostics, Some(solution), has_deviations(asked));
        }
        // Each list has its own.
        (diagnostics.native_norm_squared, diagnostics.misfit) = (None, None);
        diagnostics.mean_coefficients = None;
        Ok(EachAt { jets, variances, deviations, diagnostics, batch })
    }

    fn around_queries(
        &self,
        moving: &Moving,
        asked: ValuesRequest<'_>,
        observer: &JobObserver,
    ) -> Result<ValuesAt, Problem> {
        // It has deviations of what it finds.
        let order = asked.deviations.filter(|of| of.degree() > asked.order.degree()).unwrap_or(asked.order);
        let plan = &self.main.plan;
        let trend = plan.trend();
        let request = MovingRequest {
            order,
            has_variances: asked.has_variances,
            has_deviations: asked.deviations.is_some(),
            trend,
        };
        let values = self.main.merged(asked.values);
        let found =
            moving.at(&values, asked.queries, request, observer).map_err(|error| self.main.refused(error))?;
        let unsettled = moving
            .unsettled(&values, asked.queries, trend, observer)
            .map_err(|error| self.main.refused(error))?;
        let mut diagnostics = self
            .main
            .moving_diagnostics((found.jets.n_queries(), found.n_dependent), moving.n_neighbours())?;
        diagnostics.warn_of_unsettled(unsettled);
        self.main.warn_of_misfit(&mut diagnostics, None, has_deviations(asked));
        let variances = found.variances.map(|variances| variances.scaled(plan.scale));
        let deviations = found.deviations.map(|deviations| deviations.scaled(plan.scale));
        Ok(ValuesAt { jets: found.jets, variances, deviations, diagnostics, interpolant: None })
    }

    fn of_one_function(&self, asked: ValuesRequest<'_>, observer: &JobObserver) -> Result<ValuesAt, Problem> {
        let refused = |error| self.main.refused(error);
        let interpolant = self.interpolant(asked.values, observer)?;
        let jets = interpolant.at(asked.queries, asked.order, observer).map_err(refused)?;
        let variances = match asked.has_variances {
            false => None,
            true => {
                let trend = interpolant.solution.trend.as_ref();
                let found = variances_with_mean(&interpolant.solver, trend, asked.queries, observer);
                Some(found.map_err(refused)?.scaled(self.main.plan.scale))
            }
        };
        let deviations = self.deviations(&interpolant, asked, observer)?;
        let mut diagnostics = self.main.diagnostics(&interpolant.solution, jets.n_queries())?;
        self.main.warn_of_misfit(&mut diagnostics, Some(&interpolant.solution), has_deviations(asked));
        Ok(ValuesAt { jets, variances, deviations, diagnostics, interpolant: Some(interpolant) })
    }

    /// Of a function and its derivatives, if they are asked for; all functions on a cloud have the same.
    fn deviations(
        &self,
        function: &Interpolant,
        asked: ValuesRequest<'_>,
        observer: &JobObserver,
    ) -> Result<Option<JetDeviations>, Problem> {
        let Some(order) = asked.deviations else { return Ok(None) };
        let scale = self.main.plan.scale;
        let found = JetDeviations::of(function, scale, asked.queries, order.degree(), observer);
        found.map(Some).map_err(|error| self.main.refused(error))
    }
}
