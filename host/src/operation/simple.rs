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
use crate::wire::read::body::UnpackedBody;
use crate::wire::read::limits::ParseContext;
use crate::wire::write::answer::Answer as Members;
use gramian_observer::Price;

/// A computation over HTTP: a request with its price, and the answer to it.
pub trait Operation: DeserializeOwned + Send + 'static {
    /// Operation id in the OpenAPI document.
    const NAME: &'static str;

    /// Formats of answers, the preferred one first. Answers of one matrix also have npy.
    const FORMATS: &'static [Format] = &[Format::Json, Format::Safetensors];

    type Answer: Members + 'static;

    /// Limits of the service, or whatever else is needed to check a request.
    type Context: Send + 'static;

    /// Checks the request, as far as that needs no computation, and prices the work and its answer.
    ///
    /// # Errors
    /// Returns the [`Problem`] for the client.
    fn plan(&self, context: &Self::Context) -> Result<Price, Problem>;

    /// Computes the answer on the pool.
    ///
    /// # Errors
    /// Returns the [`Problem`] for the client.
    fn compute(self, context: &Self::Context, observer: &JobObserver) -> Result<Self::Answer, Problem>;
}

/// Returns an operation as it is served to one request.
pub fn operation<O: Operation>(context: O::Context) -> AnyOperation {
    let parse = |body: &UnpackedBody, parsing: &ParseContext<'_>| -> Result<Box<dyn AnyRequest>, Problem> {
        Ok(Box::new(ParsedRequest { request: body.parse::<O>(parsing)?, context }))
    };
    AnyOperation { name: O::NAME, formats: O::FORMATS, parse: Box::new(parse) }
}

struct ParsedRequest<O: Operation> {
    request: O,
    context: O::Context,
}

impl<O: Operation> AnyRequest for ParsedRequest<O> {
    fn begin(
        self: Box<Self>,
        call: &Call,
        intake: Reservation,
        observer: &JobObserver,
    ) -> Result<Next, Problem> {
        let price = self.request.plan(&self.context)?;
        let Price { n_bytes, flops } = price;
        let priced = PricedRequest { parsed: *self, price, intake };
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
struct PricedRequest<O: Operation> {
    parsed: ParsedRequest<O>,
    price: Price,
    /// Memory of the request until its answer is computed.
    intake: Reservation,
}

impl<O: Operation> PricedRequest<O> {
    fn ready(self, call: &Call, memory: Reservation) -> Ready {
        let Self { parsed: ParsedRequest { request, context }, price: Price { flops, .. }, intake } = self;
        let work = move |observer: &JobObserver| -> Result<Box<dyn Members>, Problem> {
            Ok(Box::new(request.compute(&context, observer)?))
        };
        let headers = AnswerHeaders::parsed_in(call.began.elapsed());
        Ready { work: Box::new(work), flops, intake, memory, headers }
    }
}

impl<O: Operation> Step for PricedRequest<O> {
    fn advance<'a>(self: Box<Self>, call: &'a Call) -> BoxFuture<'a, Result<Next, Problem>> {
        async move {
            let Price { n_bytes, flops } = self.price;
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
