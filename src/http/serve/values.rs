//! Values at queries, from whichever solver the fit has.

use std::borrow::Cow;

use super::fitted::Fits;
use crate::http::compute::JobObserver;
use crate::http::fields::Diagnostics;
use crate::http::problem::Problem;
use crate::numerics::function::interpolant::Interpolant;
use crate::numerics::function::moving::{Moving, MovingRequest};
use crate::numerics::function::posterior::{Variances, variances_with_mean};
use crate::numerics::points::cloud::Cloud;
use crate::numerics::sums::jets::{JetOrder, Jets};

/// A function at queries, and how sure it is.
pub struct ValuesAt {
    pub jets: Jets,
    /// If asked for.
    pub variances: Option<Variances>,
    pub diagnostics: Diagnostics,
    /// The function, where there is one for all queries.
    pub interpolant: Option<Interpolant>,
}

/// What is asked at queries.
#[derive(Clone, Copy)]
pub struct ValuesRequest<'a> {
    /// One per point of the request's cloud.
    pub values: &'a [f64],
    pub queries: &'a Cloud,
    pub order: JetOrder,
    pub has_variances: bool,
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

    fn around_queries(
        &self,
        moving: &Moving,
        asked: ValuesRequest<'_>,
        observer: &JobObserver,
    ) -> Result<ValuesAt, Problem> {
        let request = MovingRequest { order: asked.order, has_variances: asked.has_variances };
        let plan = &self.main.plan;
        let values = self.main.merged(asked.values);
        let rest = match &plan.trend {
            None => values,
            Some(trend) => Cow::Owned(trend.removed_from(&values, &plan.fitted)),
        };
        let mut found =
            moving.at(&rest, asked.queries, request, observer).map_err(|error| self.main.refused(error))?;
        if let Some(trend) = &plan.trend {
            found.jets = found.jets.plus_linear(asked.queries, &trend.gradient(), |x| trend.at(x));
        }
        let diagnostics = self.main.moving_diagnostics(&found, moving.n_neighbours())?;
        let variances = found.variances.map(|variances| variances.scaled(plan.scale));
        Ok(ValuesAt { jets: found.jets, variances, diagnostics, interpolant: None })
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
        let diagnostics = self.main.diagnostics(&interpolant.solution, jets.n_queries())?;
        Ok(ValuesAt { jets, variances, diagnostics, interpolant: Some(interpolant) })
    }
}
