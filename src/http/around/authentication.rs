//! Who asks: the owner of the bearer key.

use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use axum::body::{Body, Bytes};
use axum::extract::{Request, State};
use axum::http::header;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use http_body::{Body as HttpBody, Frame, SizeHint};

use crate::http::access::Entered;
use crate::http::problem::Problem;
use crate::http::problem::slug::Slug;
use crate::http::serve::app::App;
use crate::store::Owner;

/// The name of the key that a request was made with, as an extension of its answer, for the log.
#[derive(Clone)]
pub struct KeyName(pub String);

/// Lets requests with a valid key through that are within its limits, with their [`Owner`] as an extension.
pub async fn authenticate(State(app): State<Arc<App>>, mut request: Request, next: Next) -> Response {
    if app.keys.is_open() {
        request.extensions_mut().insert(Owner(0));
        return next.run(request).await;
    }
    let Some(caller) = bearer_key(&request).and_then(|key| app.keys.caller_of(key)) else {
        let detail = "send Authorization: Bearer <key> with a valid key";
        return Problem::new(Slug::Unauthorized, detail).into_response();
    };
    let mut response = match caller.enter() {
        Err(too_many) => Problem::rate_limited(&too_many.limit, too_many.retry_after_seconds).into_response(),
        Ok(entered) => {
            request.extensions_mut().insert(caller.owner);
            next.run(request).await.map(|body| Body::new(UnderWay { body, _entered: entered }))
        }
    };
    if let Some(name) = &caller.name {
        response.extensions_mut().insert(KeyName(name.clone()));
    }
    response
}

/// An answer that counts among the requests of its key until it is sent, or nobody wants it: events may go on for hours.
struct UnderWay {
    body: Body,
    _entered: Entered,
}

impl HttpBody for UnderWay {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(&mut self.body).poll_frame(cx)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

/// The scheme is case-insensitive (RFC 9110, section 11.1).
fn bearer_key(request: &Request) -> Option<&str> {
    let (scheme, key) = request.headers().get(header::AUTHORIZATION)?.to_str().ok()?.split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then(|| key.trim())
}
