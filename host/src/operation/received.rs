//! From the bytes of a request to its first step.

use std::sync::Arc;
use std::time::Instant;

use axum::extract::Request;

use super::intake::{ReceivedBody, read_body};
use super::{AnyOperation, Call, Next};
use crate::compute::JobObserver;
use crate::memory::Owner;
use crate::memory::budget::Reservation;
use crate::problem::Problem;
use crate::state::host::Host;
use crate::wire::negotiation::{AnswerEncoding, BodyFormat};
use crate::wire::read::body::UnpackedBody;
use crate::wire::read::limits::ParseContext;

/// Formats of compute requests.
pub const REQUEST_FORMATS: [BodyFormat; 2] = [BodyFormat::Json, BodyFormat::Safetensors];

/// A parsed request of any operation.
pub trait AnyRequest: Send {
    /// Goes on as far as nothing has to be awaited, within the job that parsed the request. `memory` is that
    /// of the parsed request.
    ///
    /// # Errors
    /// Returns the refusals of the request.
    fn begin(
        self: Box<Self>,
        call: &Call,
        memory: Reservation,
        observer: &JobObserver,
    ) -> Result<Next, Problem>;
}

/// Parses a body. Returns the errors of [`UnpackedBody::parse`].
pub type Parse =
    Box<dyn FnOnce(&UnpackedBody, &ParseContext<'_>) -> Result<Box<dyn AnyRequest>, Problem> + Send>;

/// A request whose body is read, with a place among threads and queue.
pub struct ReceivedRequest {
    body: ReceivedBody,
    parse: Parse,
}

impl ReceivedRequest {
    /// Settles the formats of body and answer, reads the body, and takes a place.
    ///
    /// # Errors
    /// 406, 408, 413, 415, or 503 if there is no place or no memory.
    pub async fn read(
        host: Arc<Host>,
        owner: Owner,
        request: Request,
        operation: AnyOperation,
    ) -> Result<(Call, Self), Problem> {
        let (parts, body) = request.into_parts();
        let wanted = Some(AnswerEncoding::of(&parts.headers, operation.formats)?);
        let body = read_body(&host, owner, &parts.headers, body, &REQUEST_FORMATS).await?;
        let admission = host.compute.admit(owner)?;
        let AnyOperation { name, parse, .. } = operation;
        let call = Call { host, admission, operation: name, wanted, began: Instant::now() };
        Ok((call, Self { body, parse }))
    }

    /// Parses the request, and goes on as far as nothing has to be awaited.
    ///
    /// # Errors
    /// Returns the refusals of the request.
    pub async fn parse(self, call: &Call) -> Result<Next, Problem> {
        let flops = self.body.body.flops_to_parse();
        let Self { body, parse } = self;
        let parse = move |call: &Call, observer: &JobObserver| {
            let (body, memory) = body.unpack(&call.host, observer)?;
            let request = parse(&body, &call.host.context(observer))?;
            drop(body);
            request.begin(call, memory, observer)
        };
        call.run(flops, parse).await
    }
}
