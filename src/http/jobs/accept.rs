//! Requests that become jobs.

use std::sync::Arc;

use axum::extract::{MatchedPath, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::look::view_of_here;
use super::{Here, Runner};
use crate::http::around::middleware::CLOUD_HEADER;
use crate::http::around::trace::TraceParent;
use crate::http::problem::Problem;
use crate::http::serve::durable::unavailable;
use crate::http::serve::intake::read_bytes;
use crate::http::wire::write::json::Json;
use crate::store::Owner;
use crate::store::objects::jobs::{JobId, JobRequest};

const PREFER: HeaderName = HeaderName::from_static("prefer");
const PREFERENCE_APPLIED: HeaderName = HeaderName::from_static("preference-applied");

/// What a job takes over of the head of its request: nothing that is secret.
static KEPT_HEADERS: [HeaderName; 5] =
    [header::ACCEPT, header::ACCEPT_ENCODING, header::CONTENT_TYPE, header::CONTENT_ENCODING, CLOUD_HEADER];

/// The trace that its work belongs to.
const TRACE: &str = "traceparent";

/// What takes no longer than its body takes to come: there the preference is passed over.
const AT_ONCE: [&str; 2] = ["/v1/clouds", "/v1/estimate"];

/// Answers 202 to a POST that prefers so, and has it answered behind its client.
pub async fn respond_async(State(runner): State<Runner>, request: Request, next: Next) -> Response {
    let may_be_long = request.method() == Method::POST && !AT_ONCE.contains(&request.uri().path());
    // What no route has is refused at once.
    let has_route = request.extensions().get::<MatchedPath>().is_some();
    if !may_be_long || !has_route || !prefers_async(request.headers()) {
        return next.run(request).await;
    }
    match accept(runner, request).await {
        Ok(response) => response,
        Err(problem) => problem.into_response(),
    }
}

/// RFC 7240, section 2: preferences are separated by commas, may have parameters, and their names have no case.
fn prefers_async(headers: &HeaderMap) -> bool {
    let lines = headers.get_all(PREFER).iter().filter_map(|line| line.to_str().ok());
    let mut preferences = lines.flat_map(|line| line.split(','));
    preferences.any(|preference| {
        preference.split(';').next().is_some_and(|name| name.trim().eq_ignore_ascii_case("respond-async"))
    })
}

async fn accept(runner: Runner, request: Request) -> Result<Response, Problem> {
    let app = runner.app.clone();
    let (parts, body) = request.into_parts();
    let owner = parts.extensions.get::<Owner>().copied().ok_or_else(Problem::internal)?;
    let (bytes, memory) = read_bytes(&app, owner, &parts.headers, body).await?;
    let path = parts.uri.path().to_owned();
    let kept = KEPT_HEADERS.iter().filter_map(|name| {
        let text = parts.headers.get(name)?.to_str().ok()?;
        Some((name.as_str().to_owned(), text.to_owned()))
    });
    let trace = parts.extensions.get::<TraceParent>().map(|parent| (TRACE.to_owned(), parent.to_string()));
    let request = JobRequest { path, headers: kept.chain(trace).collect() };
    let id = JobId::new();
    let Some(here) = app.jobs.add(id, owner, None) else { return Err(app.compute.out_of_memory()) };
    // It is not here any more, unless it is taken up below.
    let mut entered = Entered { runner: &runner, here: Some(here) };
    if !app.jobs.hold(id, owner, bytes.len()) {
        return Err(app.compute.out_of_memory());
    }
    let written = app.jobs.objects.put_job(&app.keys.name_of(owner), id, &request, bytes.into()).await;
    written.map_err(|error| unavailable(&error))?;
    drop(memory);
    let Some(here) = entered.here.take() else { return Err(Problem::internal()) };
    let view = view_of_here(&here);
    tokio::spawn(runner.clone().run(here));
    let location = format!("/v1/jobs/{id}");
    let applied = HeaderValue::from_static("respond-async");
    let mut response = (StatusCode::ACCEPTED, [(header::LOCATION, location)], Json(view)).into_response();
    response.headers_mut().insert(PREFERENCE_APPLIED, applied);
    Ok(response)
}

/// A job that is here only until something fails, or its client leaves.
struct Entered<'a> {
    runner: &'a Runner,
    here: Option<Arc<Here>>,
}

impl Drop for Entered<'_> {
    fn drop(&mut self) {
        if let Some(here) = self.here.take() {
            self.runner.app.jobs.held().remove(&here.id);
            self.runner.app.jobs.remove(&here);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_preference_is_found_among_others() {
        let prefers = |lines: &[&str]| {
            let mut headers = HeaderMap::new();
            for line in lines {
                headers.append(PREFER, HeaderValue::from_str(line).unwrap());
            }
            prefers_async(&headers)
        };
        assert!(prefers(&["respond-async"]) && prefers(&["return=minimal, Respond-Async; a=b", "wait=1"]));
        assert!(prefers(&["wait=1", "respond-async"]) && prefers(&[",respond-async"]));
        assert!(!prefers(&[]) && !prefers(&["respond-asynchronously"]) && !prefers(&["a=respond-async"]));
    }
}
