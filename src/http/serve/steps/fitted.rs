//! From models that are ready to the answer.

use std::time::Instant;

use super::Call;
use super::answer::Answer;
use crate::http::compute::JobObserver;
use crate::http::problem::Problem;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::AnyWork;
use crate::http::serve::report::AnswerHeaders;
use crate::http::wire::write::encode::Encoded;
use crate::store::budget::Reservation;

/// A request whose models are ready.
pub struct Fitted {
    pub fits: Fits,
    pub work: Box<dyn AnyWork>,
    /// Flops of the work.
    pub flops: f64,
    /// Memory of the request until its answer is computed.
    pub intake: Reservation,
    /// Memory of the work and of the answer.
    pub memory: Reservation,
    pub report: AnswerHeaders,
}

impl Fitted {
    /// Computes and encodes the answer.
    ///
    /// # Errors
    /// Returns the refusals of the computation.
    pub async fn answer(self, call: &Call) -> Result<Box<Answer>, Problem> {
        let flops = self.flops;
        call.run(flops, move |call, observer| self.answered(call, observer).map(Box::new)).await
    }

    /// Computes and encodes the answer, within a job on the pool.
    ///
    /// # Errors
    /// Returns the refusals of the computation.
    pub fn answered(self, call: &Call, observer: &JobObserver) -> Result<Answer, Problem> {
        let Self { fits, work, intake, memory, mut report, .. } = self;
        // Estimates end before this step.
        let wanted = call.wanted.ok_or_else(Problem::internal)?;
        let answer = work.compute(&fits, observer)?;
        drop(intake);
        let times = observer.times();
        let began = Instant::now();
        let encoded = Encoded::of(answer, wanted)?;
        report.computed(times, (!encoded.is_streamed()).then_some(began.elapsed()));
        Ok(Answer { encoded, memory, report, fresh: Vec::new() })
    }
}
