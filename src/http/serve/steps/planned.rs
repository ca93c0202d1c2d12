//! From the plan of a request to its complete fits.

use std::sync::Arc;

use super::resolved::ResolvedRequest;
use super::{OnCall, Step};
use crate::http::problem::Problem;
use crate::http::serve::operation::{AnyWork, Plan};
use crate::http::serve::sampling::find_lacking;
use crate::store::clouds::RegisteredCloud;
use gramian_host::compute::JobObserver;
use gramian_host::memory::budget::Reservation;
use gramian_numerics::observer::Observer;

/// A request that is checked. Its fits are complete as far as the request defines them.
pub struct PlannedRequest {
    plan: Plan<Box<dyn AnyWork>>,
    /// Memory of the request until its answer is computed.
    memory: Reservation,
    /// Clouds that came with the request and are only in memory.
    fresh: Vec<Arc<RegisteredCloud>>,
}

impl PlannedRequest {
    /// Keeps of `memory` what the plan holds.
    pub fn of(
        plan: Plan<Box<dyn AnyWork>>,
        mut memory: Reservation,
        fresh: Vec<Arc<RegisteredCloud>>,
    ) -> Self {
        memory.shrink_to(plan.fits.n_bytes_held());
        Self { plan, memory, fresh }
    }

    /// Goes on to the answer, within the job that planned the request, as far as nothing has to be awaited.
    ///
    /// # Errors
    /// Returns the refusals of the request.
    pub fn go_on(mut self, on: &OnCall, observer: &JobObserver) -> Result<Step, Problem> {
        if self.plan.fits.lacking_mut().is_some() {
            return Ok(Step::Planned(Box::new(self)));
        }
        self.resolved(observer)?.go_on(on, observer)
    }

    /// Finds the facts about clouds and values that fits lack, and completes the fits.
    ///
    /// # Errors
    /// Returns the errors of [`find_lacking`], and the refusals of the fits.
    pub async fn resolve(mut self, on: &OnCall) -> Result<Step, Problem> {
        while let Some(fit) = self.plan.fits.lacking_mut() {
            find_lacking(&on.app, &on.call.admission, fit).await?;
        }
        let flops = self.plan.fits.resolving_flops();
        let resolve = move |_: &OnCall, observer: &JobObserver| self.resolved(observer);
        on.run(flops, resolve).await.map(|resolved| Step::Resolved(Box::new(resolved)))
    }

    fn resolved(self, observer: &dyn Observer) -> Result<ResolvedRequest, Problem> {
        let Self { plan: Plan { fits, work }, memory, fresh } = self;
        Ok(ResolvedRequest { fits: fits.resolve(observer)?, work, memory, fresh })
    }
}
