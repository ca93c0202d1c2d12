//! Authentication: the owner of a request is the owner of its bearer key.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::header;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use http_body_util::BodyExt;

use crate::access::ConcurrencyPermit;
use crate::memory::Owner;
use crate::problem::Problem;
use crate::problem::catalogue;
use crate::state::host::Host;

/// Name of the key that made the request. An extension of the answer, for the log.
#[derive(Clone)]
pub struct KeyName(pub String);

/// Admits requests that have a valid key and are within its limits. The [`Owner`] becomes an extension of the
/// request.
pub async fn authenticate(State(host): State<Arc<Host>>, mut request: Request, next: Next) -> Response {
    if host.keys.is_open() {
        request.extensions_mut().insert(Owner(0));
        return next.run(request).await;
    }
    let Some(caller) = bearer_key(&request).and_then(|key| host.keys.caller_of(key)) else {
        let detail = "send Authorization: Bearer <key> with a valid key";
        return Problem::new(catalogue::UNAUTHORIZED, detail).into_response();
    };
    let mut response = match caller.enter() {
        Err(too_many) => Problem::rate_limited(&too_many.limit, too_many.retry_after_seconds).into_response(),
        Ok(entered) => {
            request.extensions_mut().insert(caller.owner);
            until_sent(next.run(request).await, entered)
        }
    };
    if let Some(name) = &caller.name {
        response.extensions_mut().insert(KeyName(name.clone()));
    }
    response
}

/// Counts the request as in progress until the answer is sent or dropped. Streams of events may take hours.
fn until_sent(answer: Response, entered: ConcurrencyPermit) -> Response {
    answer.map(|body| {
        Body::new(body.map_err(move |error| {
            // The closure lives as long as the body. Bytes and length of the body are unchanged.
            let _ = &entered;
            error
        }))
    })
}

/// Returns the key of the `Authorization` header. The scheme is case-insensitive (RFC 9110, section 11.1).
fn bearer_key(request: &Request) -> Option<&str> {
    let (scheme, key) = request.headers().get(header::AUTHORIZATION)?.to_str().ok()?.split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then(|| key.trim())
}
