//! The steps of a request that needs models, a type for each: `ParsedRequest → PlannedRequest →
//! ResolvedRequest`, and then [`Ready`](gramian_host::operation::Ready).
//!
//! Before each step the request awaits what that step needs: clouds from the store, facts about clouds and
//! values, memory, models. Where nothing has to be awaited, it goes on within the same job. A small request
//! whose models are ready is answered by the job that parsed it.

mod estimate;
mod parsed;
mod planned;
mod resolved;

use std::sync::Arc;

use axum::extract::Request;
use axum::response::Response;
use futures_util::FutureExt;
use futures_util::future::{BoxFuture, join};

use super::durable::keep_all;
use super::operation::AnyOperation;
use crate::http::problem::Problem;
use crate::http::state::app::App;
use crate::store::clouds::RegisteredCloud;
pub use estimate::{Estimate, estimate};
use gramian_host::compute::JobObserver;
use gramian_host::memory::Owner;
use gramian_host::memory::budget::Reservation;
use gramian_host::operation::{self, Answer, AnyRequest, Call, Next};
use gramian_host::wire::read::body::UnpackedBody;
use gramian_host::wire::read::limits::ParseContext;
use parsed::ParsedRequest;
use planned::PlannedRequest;
use resolved::ResolvedRequest;

/// A step that a request has reached.
enum Step {
    Parsed(Box<ParsedRequest>),
    Planned(Box<PlannedRequest>),
    Resolved(Box<ResolvedRequest>),
    Answer(Box<AnswerToStore>),
}

/// An answer, with clouds of the request that the store does not have yet.
struct AnswerToStore {
    answer: Answer,
    fresh: Vec<Arc<RegisteredCloud>>,
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
    let AnyOperation { name, formats, parse, .. } = operation;
    let host = app.host.clone();
    let parse =
        move |body: &UnpackedBody, context: &ParseContext<'_>| -> Result<Box<dyn AnyRequest>, Problem> {
            Ok(Box::new(OnApp { app, step: parse(body, context)? }))
        };
    let operation = operation::AnyOperation { name, formats, parse: Box::new(parse) };
    operation::serve(host, owner, request, operation)
}

/// A request, or a step of one, with the application that serves it.
struct OnApp<T> {
    app: Arc<App>,
    step: T,
}

impl AnyRequest for OnApp<Box<dyn super::operation::AnyRequest>> {
    fn begin(
        self: Box<Self>,
        call: &Call,
        memory: Reservation,
        observer: &JobObserver,
    ) -> Result<Next, Problem> {
        let Self { app, step: request } = *self;
        let step = ParsedRequest::begin(&on(&app, call), request, memory, observer)?;
        Ok(next(app, step))
    }
}

impl operation::Step for OnApp<Step> {
    fn advance<'a>(self: Box<Self>, call: &'a Call) -> BoxFuture<'a, Result<Next, Problem>> {
        async move {
            let Self { app, step } = *self;
            let on = on(&app, call);
            let step = match step {
                Step::Parsed(parsed) => parsed.plan(&on).await?,
                Step::Planned(planned) => planned.resolve(&on).await?,
                Step::Resolved(mut resolved) => {
                    let fresh = std::mem::take(&mut resolved.fresh);
                    let answering = async { resolved.ready(&on).await?.answer(call).await };
                    // The store receives new clouds while the answer is computed.
                    let answered = join(answering, keep_all(&app, call.admission.owner, &fresh)).await;
                    return answered.0.map(Next::Answer);
                }
                Step::Answer(answered) => {
                    keep_all(&app, call.admission.owner, &answered.fresh).await;
                    return Ok(Next::Answer(Box::new(answered.answer)));
                }
            };
            Ok(next(app, step))
        }
        .boxed()
    }
}

fn next(app: Arc<App>, step: Step) -> Next {
    match step {
        Step::Answer(answered) if answered.fresh.is_empty() => Next::Answer(Box::new(answered.answer)),
        step => Next::Step(Box::new(OnApp { app, step })),
    }
}

/// A call, with the application that serves it.
#[derive(Clone)]
struct OnCall {
    app: Arc<App>,
    call: Call,
}

fn on(app: &Arc<App>, call: &Call) -> OnCall {
    OnCall { app: app.clone(), call: call.clone() }
}

impl OnCall {
    fn owner(&self) -> Owner {
        self.call.admission.owner
    }

    /// Runs steps of the request on the pool.
    async fn run<T: Send + 'static>(
        &self,
        flops: f64,
        steps: impl FnOnce(&Self, &JobObserver) -> Result<T, Problem> + Send + 'static,
    ) -> Result<T, Problem> {
        let on = self.clone();
        self.call.run(flops, move |_, observer| steps(&on, observer)).await
    }
}
