//! Operations that need nothing but their own request.

use futures_util::FutureExt;
use futures_util::future::BoxFuture;
use serde::de::DeserializeOwned;

use super::{AnswerHeaders, AnyOperation, AnyRequest, Call, Next, Outlook, Ready, Step};
use crate::compute::{JobObserver, is_light};
use crate::memory::budget::Reservation;
use crate::problem::Problem;
use crate::state::host::Host;
use crate::wire::negotiation::Format;
use crate::wire::write::answer::Answer as Members;
use gramian_observer::Price;

/// A computation over HTTP: a request with its price, and the answer to it.
pub trait Operation: DeserializeOwned + Send + 'static {
    /// Operation id in the OpenAPI document.
    const NAME: &'static str;

    /// Formats of answers, the preferred one first. Answers of one matrix also have npy.
    const FORMATS: &'static [Format] = &[Format::Json, Format::Safetensors];

    type Answer: Members + 'static;

    /// Checks the request, as far as that needs no computation, and prices the work and its answer.
    ///
    /// # Errors
    /// Returns the [`Problem`] for the client.
    fn plan(&self) -> Result<Price, Problem>;

    /// Computes the answer on the pool.
    ///
    /// # Errors
    /// Returns the [`Problem`] for the client.
    fn compute(self, observer: &JobObserver) -> Result<Self::Answer, Problem>;
}

/// Returns an operation as it is served.
pub fn operation<O: Operation>() -> AnyOperation {
    AnyOperation {
        name: O::NAME,
        formats: O::FORMATS,
        parse: Box::new(|body, context| Ok(Box::new(Parsed(body.parse::<O>(context)?)))),
    }
}

struct Parsed<O>(O);

impl<O: Operation> AnyRequest for Parsed<O> {
    fn begin(
        self: Box<Self>,
        call: &Call,
        intake: Reservation,
        observer: &JobObserver,
    ) -> Result<Next, Problem> {
        let Parsed(request) = *self;
        let Price { n_bytes, flops } = request.plan()?;
        let priced = Priced { request, n_bytes, flops, intake };
        if call.wanted.is_none() || !is_light(flops) {
            return Ok(Next::Step(Box::new(priced)));
        }
        let Some(memory) = call.host.work.try_reserve(call.admission.owner, n_bytes) else {
            return Ok(Next::Step(Box::new(priced)));
        };
        Ok(Next::Answer(Box::new(priced.ready(call, memory).answer_at_once(call, observer)?)))
    }
}

/// A request whose price is known.
struct Priced<O> {
    request: O,
    n_bytes: usize,
    flops: f64,
    /// Memory of the request until its answer is computed.
    intake: Reservation,
}

impl<O: Operation> Priced<O> {
    fn ready(self, call: &Call, memory: Reservation) -> Ready {
        let Self { request, flops, intake, .. } = self;
        let work = |observer: &JobObserver| -> Result<Box<dyn Members>, Problem> {
            Ok(Box::new(request.compute(observer)?))
        };
        let headers = AnswerHeaders::parsed_in(call.began.elapsed());
        Ready { work: Box::new(work), flops, intake, memory, headers }
    }
}

impl<O: Operation> Step for Priced<O> {
    fn advance<'a>(self: Box<Self>, call: &'a Call) -> BoxFuture<'a, Result<Next, Problem>> {
        async move {
            let Self { n_bytes, flops, .. } = *self;
            call.check_deadline(Outlook { flops, n_bytes, is_cached: true })?;
            let memory = call.host.reserve(call.admission.owner, n_bytes).await?;
            self.ready(call, memory).answer(call).await.map(Next::Answer)
        }
        .boxed()
    }
}

impl Host {
    /// Waits for memory for work. To avoid deadlocks, the caller must hold no other memory for work.
    ///
    /// # Errors
    /// 413 `problem-too-large` if the budget will never have that much.
    async fn reserve(&self, owner: crate::memory::Owner, n_bytes: usize) -> Result<Reservation, Problem> {
        let reserved = self.work.reserve(owner, n_bytes, |_| std::ops::ControlFlow::Continue(())).await;
        let remedy = "ask for less, or raise GRAMIAN_MEMORY_BYTES";
        let reserved = reserved.map_err(|beyond| Self::beyond_memory(beyond, n_bytes, remedy))?;
        reserved.ok_or_else(|| self.compute.out_of_memory())
    }
}
