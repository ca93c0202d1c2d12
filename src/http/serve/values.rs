//! Values at queries, from whichever solver the fit has.

use super::fitted::Fits;
use crate::http::compute::JobObserver;
use crate::http::fields::Diagnostics;
use crate::http::problem::Problem;
use crate::numerics::function::interpolant::Interpolant;
use crate::numerics::function::moving::{Moving, MovingRequest};
use crate::numerics::function::posterior::{Variances, variances};
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
        let found = moving
            .at(&self.main.merged(asked.values), asked.queries, request, observer)
            .map_err(|error| self.main.refused(error))?;
        let diagnostics = self.main.moving_diagnostics(&found, moving.n_neighbours())?;
        Ok(ValuesAt { jets: found.jets, variances: found.variances, diagnostics, interpolant: None })
    }

    fn of_one_function(&self, asked: ValuesRequest<'_>, observer: &JobObserver) -> Result<ValuesAt, Problem> {
        let refused = |error| self.main.refused(error);
        let interpolant = self.interpolant(asked.values, observer)?;
        let jets = interpolant.at(asked.queries, asked.order, observer).map_err(refused)?;
        let variances = match asked.has_variances {
            false => None,
            true => Some(variances(&interpolant.solver, asked.queries, observer).map_err(refused)?),
        };
        let diagnostics = self.main.diagnostics(&interpolant.solution, jets.n_queries())?;
        Ok(ValuesAt { jets, variances, diagnostics, interpolant: Some(interpolant) })
    }
}
