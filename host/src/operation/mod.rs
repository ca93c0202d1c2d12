//! The way of a request from its body to its answer, whatever it computes.
//!
//! A request is read, takes a place among threads and queue, and is parsed on the pool. It then goes on in
//! steps ([`Step`]): a service has one wherever it has to await something. Each states its cost before it
//! begins. The last one is [`Ready`]: everything is at hand, and one job computes and encodes the answer.
//!
//! Jobs wait for a thread, so a step goes on within the job of the step before it wherever nothing has to be
//! awaited. A small request is answered by the job that parsed it.
//!
//! A service whose requests need nothing but their own body implements [`Operation`], and gets all steps from
//! here.

mod answer;
mod call;
mod headers;
pub mod intake;
mod ready;
mod received;
mod simple;
#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::time::Instant;

use axum::extract::Request;
use axum::response::Response;
use futures_util::FutureExt;
use futures_util::future::BoxFuture;

use crate::memory::Owner;
use crate::problem::Problem;
use crate::state::host::Host;
pub use answer::Answer;
pub use call::{Call, Outlook};
pub use headers::AnswerHeaders;
pub use ready::{Computation, Ready};
pub use received::{AnyRequest, Parse, REQUEST_FORMATS, ReceivedRequest};
pub use simple::{Operation, operation};

/// A step that a request has reached, where something has to be awaited before it goes on.
pub trait Step: Send {
    /// Goes on to the next step.
    fn advance<'a>(self: Box<Self>, call: &'a Call) -> BoxFuture<'a, Result<Next, Problem>>;
}

/// The next state of a request: another step, or its answer.
pub enum Next {
    Step(Box<dyn Step>),
    Answer(Box<Answer>),
}

/// An operation, as it is served.
pub struct AnyOperation {
    /// Operation id in the OpenAPI document.
    pub name: &'static str,
    /// Formats of answers, the preferred one first.
    pub formats: &'static [crate::wire::negotiation::Format],
    pub parse: Parse,
}

/// Serves one request.
///
/// # Errors
/// Returns the [`Problem`] for the client.
pub fn serve(
    host: Arc<Host>,
    owner: Owner,
    request: Request,
    operation: AnyOperation,
) -> BoxFuture<'static, Result<Response, Problem>> {
    async move {
        let (call, received) = ReceivedRequest::read(host, owner, request, operation).await?;
        let mut next = received.parse(&call).await?;
        loop {
            next = match next {
                Next::Step(step) => step.advance(&call).await?,
                Next::Answer(answer) => return Ok(answer.respond(&call)),
            };
        }
    }
    .boxed()
}

/// A call of an operation that is not answered by it, such as an estimate.
pub fn unanswered(host: Arc<Host>, admission: Arc<crate::compute::Admission>, name: &'static str) -> Call {
    Call { host, admission, operation: name, wanted: None, began: Instant::now() }
}
