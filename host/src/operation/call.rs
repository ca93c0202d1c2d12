//! A call of an operation: its place, the format of its answer, and what it is expected to take.

use std::sync::Arc;
use std::time::Instant;

use crate::compute::{Admission, JobObserver, Work};
use crate::problem::{Problem, catalogue};
use crate::state::host::Host;
use crate::state::settings::Settings;
use crate::wire::negotiation::AnswerEncoding;

/// A call of an operation: its place, the format of its answer, and the time at which parsing began.
#[derive(Clone)]
pub struct Call {
    pub host: Arc<Host>,
    pub admission: Arc<Admission>,
    /// Operation id in the OpenAPI document.
    pub operation: &'static str,
    /// `None` for calls that are not answered by the operation.
    pub wanted: Option<AnswerEncoding>,
    pub began: Instant,
}

/// Expected work and memory of a request.
#[derive(Debug, Clone, Copy)]
pub struct Outlook {
    pub flops: f64,
    /// Bytes that are not reserved yet.
    pub n_bytes: usize,
    /// Whether nothing is missing.
    pub is_cached: bool,
}

/// Factor by which the estimated time may exceed the deadline. Work beyond it is refused before it begins.
///
/// Estimates are within a factor of two in the median. They are further off where nothing similar has run
/// yet.
const DOUBT: f64 = 4.0;

impl Call {
    /// Runs steps of the request on the pool.
    ///
    /// # Errors
    /// Returns the errors of the steps, and 500 if they panicked.
    pub async fn run<T: Send + 'static>(
        &self,
        flops: f64,
        steps: impl FnOnce(&Self, &JobObserver) -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        let call = self.clone();
        let job = move |observer: &JobObserver| steps(&call, observer);
        self.host.compute.run(&self.admission, flops, job).await?.0
    }

    /// Seconds that the work of the call is expected to take, without the wait for a turn.
    pub fn expected_seconds(&self, outlook: Outlook) -> f64 {
        self.admission.expected_seconds(self.work(outlook))
    }

    /// Records the work of a request. Refuses it where other requests would wait for work that is not
    /// expected to end in time. An idle server tries it all the same, and learns from it if the estimate was
    /// wrong.
    ///
    /// # Errors
    /// 504 `deadline-exceeded`.
    pub fn check_deadline(&self, outlook: Outlook) -> Result<(), Problem> {
        let Self { host, admission, .. } = self;
        let Settings { deadline_seconds, job_seconds, .. } = host.settings;
        let deadline = if admission.is_job() { job_seconds } else { deadline_seconds };
        let seconds = admission.set_work(self.work(outlook));
        if seconds <= DOUBT * deadline || host.compute.is_idle_for(admission, outlook.flops) {
            return Ok(());
        }
        let detail = format!(
            "this would take about {seconds:.0} s, longer than the deadline of {deadline} s, and other work is under \
             way; nothing was computed"
        );
        Err(Problem::new(catalogue::DEADLINE_EXCEEDED, detail))
    }

    fn work(&self, outlook: Outlook) -> Work {
        Work { operation: self.operation, is_cached: outlook.is_cached, flops: outlook.flops }
    }
}
