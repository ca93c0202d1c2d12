//! From complete fits to models that are ready.

use std::sync::Arc;

use axum::http::HeaderValue;

use super::{AnswerToStore, OnCall, Step};
use crate::http::problem::Problem;
use crate::http::serve::fitted::Fits;
use crate::http::serve::fitting::Fitting;
use crate::http::serve::operation::AnyWork;
use crate::http::serve::plan::FitPlans;
use crate::http::state::app::CLOUD_HEADER;
use crate::store::clouds::RegisteredCloud;
use gramian_host::compute::{JobObserver, is_light};
use gramian_host::memory::budget::Reservation;
use gramian_host::operation::{AnswerHeaders, Outlook, Ready};

/// A request whose fits are complete.
pub struct ResolvedRequest {
    pub fits: FitPlans,
    pub work: Box<dyn AnyWork>,
    /// Memory of the request until its answer is computed.
    pub memory: Reservation,
    /// Clouds that came with the request and are only in memory.
    pub fresh: Vec<Arc<RegisteredCloud>>,
}

impl ResolvedRequest {
    /// Answers small work whose models are ready, within the job that resolved the request.
    ///
    /// # Errors
    /// Returns the refusals of the computation.
    pub fn go_on(self, on: &OnCall, observer: &JobObserver) -> Result<Step, Problem> {
        if on.call.wanted.is_none() || !is_light(self.fits.cost.flops()) {
            return Ok(Step::Resolved(Box::new(self)));
        }
        let mut headers = self.headers(on);
        let Some((fits, memory)) = self.fitting(on).at_hand(&mut headers) else {
            return Ok(Step::Resolved(Box::new(self)));
        };
        let (ready, fresh) = self.with(fits, memory, headers);
        let answer = ready.answer_at_once(&on.call, observer)?;
        Ok(Step::Answer(Box::new(AnswerToStore { answer, fresh })))
    }

    /// Finds or makes the models, in memory that is reserved for all of them at once.
    ///
    /// # Errors
    /// 413 if the request takes more memory than there is, 504 if it is expected to take too long, and the
    /// refusals of the factorization.
    pub async fn ready(self, on: &OnCall) -> Result<Ready, Problem> {
        let mut headers = self.headers(on);
        on.call.check_deadline(self.outlook(on))?;
        let (fits, memory) = self.fitting(on).fits(&mut headers).await?;
        Ok(self.with(fits, memory, headers).0)
    }

    fn with(
        self,
        fits: Fits,
        memory: Reservation,
        headers: AnswerHeaders,
    ) -> (Ready, Vec<Arc<RegisteredCloud>>) {
        let Self { fits: plans, work, memory: intake, fresh } = self;
        let compute = move |observer: &JobObserver| work.compute(&fits, observer);
        (Ready { work: Box::new(compute), flops: plans.cost.flops(), intake, memory, headers }, fresh)
    }

    /// Returns the work and memory that the answer takes, as far as they can be foreseen.
    pub fn outlook(&self, on: &OnCall) -> Outlook {
        self.fitting(on).outlook()
    }

    fn fitting<'a>(&'a self, on: &'a OnCall) -> Fitting<'a> {
        Fitting { app: &on.app, admission: &on.call.admission, plans: &self.fits }
    }

    fn headers(&self, on: &OnCall) -> AnswerHeaders {
        let id = HeaderValue::from_str(&self.fits.main.stored.id.to_string()).ok();
        AnswerHeaders::parsed_in(on.call.began.elapsed()).about(id.map(|id| (CLOUD_HEADER, id)))
    }
}
