//! The life of a request of an operation, a type for each step:
//! `Received → Parsed → Planned → Resolved → Fitted → Answer`.
//!
//! Each step is a job on the pool, after a wait for what the step needs: clouds from the store, facts about
//! clouds and values, memory, models. Jobs wait for a thread, so a job goes on with the next step where
//! nothing has to be awaited. A small request whose models are ready is answered by its first job.

mod answer;
mod estimate;
mod fitted;
mod planned;
mod received;
mod resolved;

use std::sync::Arc;
use std::time::Instant;

use axum::extract::Request;
use axum::response::Response;
use futures_util::FutureExt;
use futures_util::future::{BoxFuture, join};

use super::durable::keep_all;
use super::operation::AnyOperation;
use crate::http::compute::{Admission, JobObserver};
use crate::http::problem::Problem;
use crate::http::state::app::App;
use crate::http::wire::negotiation::Wanted;
use crate::store::Owner;
use answer::Answer;
pub use estimate::{Estimate, estimate};
use planned::Planned;
use received::{Parsed, Received};
use resolved::Resolved;

/// A step that a request has reached.
enum Step {
    Parsed(Box<Parsed>),
    Planned(Box<Planned>),
    Resolved(Box<Resolved>),
    Answer(Box<Answer>),
}

/// Serves one request.
///
/// # Errors
/// Returns the [`Problem`] for the client.
pub fn serve(
    app: Arc<App>,
    owner: Owner,
    request: Request,
    operation: AnyOperation,
) -> BoxFuture<'static, Result<Response, Problem>> {
    async move {
        let (call, received) = Received::read(app, owner, request, operation).await?;
        let mut step = received.parse(&call).await?;
        loop {
            step = match step {
                Step::Parsed(parsed) => parsed.plan(&call).await?,
                Step::Planned(planned) => planned.resolve(&call).await?,
                Step::Resolved(mut resolved) => {
                    let fresh = std::mem::take(&mut resolved.fresh);
                    let answering = async { resolved.fit(&call).await?.answer(&call).await };
                    // The store receives new clouds while the answer is computed.
                    Step::Answer(join(answering, keep_all(&call.app, owner, &fresh)).await.0?)
                }
                Step::Answer(answer) => return Ok(answer.respond(&call).await),
            };
        }
    }
    .boxed()
}

/// A call of an operation: its place, the format of its answer, and the time at which parsing began.
#[derive(Clone)]
struct Call {
    app: Arc<App>,
    admission: Arc<Admission>,
    /// Operation id in the OpenAPI document.
    operation: &'static str,
    /// `None` for estimates, which are not answered by the operation.
    wanted: Option<Wanted>,
    began: Instant,
}

impl Call {
    /// Runs steps of the request on the pool.
    async fn run<T: Send + 'static>(
        &self,
        flops: f64,
        steps: impl FnOnce(&Self, &JobObserver) -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        let call = self.clone();
        let job = move |observer: &JobObserver| steps(&call, observer);
        self.app.compute.run(&self.admission, flops, job).await?.0
    }
}
