//! From a request for which everything is at hand to its answer.

use std::time::Instant;

use super::{Answer, AnswerHeaders, Call};
use crate::compute::{JobObserver, Work};
use crate::memory::budget::Reservation;
use crate::problem::Problem;
use crate::wire::write::answer::Answer as Members;
use crate::wire::write::encode::EncodedAnswer;

/// Computes an answer, on the pool.
pub type Computation = Box<dyn FnOnce(&JobObserver) -> Result<Box<dyn Members>, Problem> + Send>;

/// A request for which everything is at hand.
pub struct Ready {
    pub work: Computation,
    /// Flops of the work.
    pub flops: f64,
    /// Memory of the request until its answer is computed.
    pub intake: Reservation,
    /// Memory of the work and of the answer.
    pub memory: Reservation,
    pub headers: AnswerHeaders,
}

impl Ready {
    /// Computes and encodes the answer.
    ///
    /// # Errors
    /// Returns the refusals of the computation.
    pub async fn answer(self, call: &Call) -> Result<Box<Answer>, Problem> {
        let flops = self.flops;
        call.run(flops, move |call, observer| self.answered(call, observer).map(Box::new)).await
    }

    /// Computes and encodes the answer within a job of the request, and learns how long that took.
    ///
    /// # Errors
    /// Returns the refusals of the computation.
    pub fn answer_at_once(self, call: &Call, observer: &JobObserver) -> Result<Answer, Problem> {
        let (flops, before) = (self.flops, observer.times());
        let answer = self.answered(call, observer)?;
        let after = observer.times();
        if !after.ended_early {
            let work = Work { operation: call.operation, is_cached: true, flops };
            call.admission.did_at_once(work, after.whole - before.whole);
        }
        Ok(answer)
    }

    fn answered(self, call: &Call, observer: &JobObserver) -> Result<Answer, Problem> {
        let Self { work, intake, memory, mut headers, .. } = self;
        // Calls that are not answered end before this step.
        let wanted = call.wanted.ok_or_else(Problem::internal)?;
        let answer = work(observer)?;
        drop(intake);
        let times = observer.times();
        let began = Instant::now();
        let encoded = EncodedAnswer::of(answer, wanted)?;
        headers.computed(times, (!encoded.is_streamed()).then_some(began.elapsed()));
        Ok(Answer { encoded, memory, headers })
    }
}
