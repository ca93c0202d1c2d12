//! From complete fits to models that are ready.

use std::sync::Arc;

use super::fitted::Fitted;
use super::{Call, Step};
use crate::config::Config;
use crate::http::compute::{JobObserver, Work, is_light};
use crate::http::problem::Problem;
use crate::http::problem::slug::Slug;
use crate::http::serve::fitting::{Fitting, Outlook};
use crate::http::serve::operation::AnyWork;
use crate::http::serve::plan::FitPlans;
use crate::http::serve::report::AnswerHeaders;
use crate::store::budget::Reservation;
use crate::store::clouds::RegisteredCloud;

/// A request whose fits are complete.
pub struct Resolved {
    pub fits: FitPlans,
    pub work: Box<dyn AnyWork>,
    /// Memory of the request until its answer is computed.
    pub memory: Reservation,
    /// Clouds that came with the request and are only in memory.
    pub fresh: Vec<Arc<RegisteredCloud>>,
}

impl Resolved {
    /// Answers small work whose models are ready, within the job that resolved the request.
    ///
    /// # Errors
    /// Returns the refusals of the computation.
    pub fn go_on(self, call: &Call, observer: &JobObserver) -> Result<Step, Problem> {
        let flops = self.fits.cost.flops();
        if call.wanted.is_none() || !is_light(flops) {
            return Ok(Step::Resolved(Box::new(self)));
        }
        let mut report = self.report(call);
        let Some((fits, memory)) = self.fitting(call).at_hand(&mut report) else {
            return Ok(Step::Resolved(Box::new(self)));
        };
        let before = observer.times();
        let fresh = self.fresh;
        let fitted = Fitted { fits, work: self.work, flops, intake: self.memory, memory, report };
        let answer = fitted.answered(call, observer)?.with_fresh(fresh);
        let after = observer.times();
        if !after.ended_early {
            let work = Work { operation: call.operation, is_cached: true, flops };
            call.admission.did_at_once(work, after.whole - before.whole);
        }
        Ok(Step::Answer(Box::new(answer)))
    }

    /// Finds or makes the models, in memory that is reserved for all of them at once.
    ///
    /// # Errors
    /// 413 if the request takes more memory than there is, 504 if it is expected to take too long, and the
    /// refusals of the factorization.
    pub async fn fit(self, call: &Call) -> Result<Fitted, Problem> {
        let mut report = self.report(call);
        within_deadline(call, self.outlook(call))?;
        let (fits, memory) = self.fitting(call).fits(&mut report).await?;
        let flops = self.fits.cost.flops();
        Ok(Fitted { fits, work: self.work, flops, intake: self.memory, memory, report })
    }

    /// Returns the work and memory that the answer takes, as far as they can be foreseen.
    pub fn outlook(&self, call: &Call) -> Outlook {
        self.fitting(call).outlook()
    }

    fn fitting<'a>(&'a self, call: &'a Call) -> Fitting<'a> {
        Fitting { app: &call.app, admission: &call.admission, plans: &self.fits }
    }

    fn report(&self, call: &Call) -> AnswerHeaders {
        AnswerHeaders::parsed_in(call.began.elapsed(), self.fits.main.stored.id)
    }
}

/// Factor by which the estimated time may exceed the deadline. Work beyond it is refused before it begins.
///
/// Estimates are within a factor of two in the median. They are further off where nothing similar has run
/// yet.
const DOUBT: f64 = 4.0;

/// Records the work of a request. Refuses it where other requests would wait for work that is not expected to
/// end in time. An idle server tries it all the same, and learns from it if the estimate was wrong.
fn within_deadline(call: &Call, outlook: Outlook) -> Result<(), Problem> {
    let Call { app, admission, operation, .. } = call;
    let Config { deadline_seconds, job_seconds, .. } = app.config;
    let deadline = if admission.is_job() { job_seconds } else { deadline_seconds };
    let seconds = admission.set_work(outlook.as_work(operation));
    if seconds <= DOUBT * deadline || app.compute.is_idle_for(admission, outlook.flops) {
        return Ok(());
    }
    let detail = format!(
        "this would take about {seconds:.0} s, longer than the deadline of {deadline} s, and other work is under way; \
         nothing was computed"
    );
    Err(Problem::new(Slug::DeadlineExceeded, detail))
}
