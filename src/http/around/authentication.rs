//! Who asks: the owner of the bearer key.

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::header;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::http::problem::Problem;
use crate::http::problem::slug::Slug;
use crate::http::serve::app::App;
use crate::store::Owner;

/// Lets requests with a valid key through, with their [`Owner`] as an extension.
pub async fn authenticate(State(app): State<Arc<App>>, mut request: Request, next: Next) -> Response {
    let owner = if app.keys.is_open() {
        Some(Owner(0))
    } else {
        bearer_key(&request).and_then(|key| app.keys.owner_of(key))
    };
    match owner {
        Some(owner) => {
            request.extensions_mut().insert(owner);
            next.run(request).await
        }
        None => Problem::new(Slug::Unauthorized, "send Authorization: Bearer <key> with a valid key")
            .into_response(),
    }
}

/// The scheme is case-insensitive (RFC 9110, section 11.1).
fn bearer_key(request: &Request) -> Option<&str> {
    let (scheme, key) = request.headers().get(header::AUTHORIZATION)?.to_str().ok()?.split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then(|| key.trim())
}
