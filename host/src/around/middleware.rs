//! Middleware around every handler: request id, log line, problem documents, negotiation, deadline.

use std::any::Any;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use axum::extract::{MatchedPath, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use uuid::Uuid;

use super::authentication::KeyName;
use super::span::RequestSpan;
use super::transport;
use crate::memory::CacheOutcome;
use crate::problem::Problem;
use crate::problem::catalogue;
use crate::state::host::{Host, Subject};
use crate::wire::negotiation::{AnswerEncoding, Format};

/// Most bytes of a method and of a path that are logged, because clients may send any number.
const LOGGED_METHOD_BYTES: usize = 32;
const LOGGED_PATH_BYTES: usize = 200;

/// Content security policy of HTML pages that have none of their own: they are text, and load nothing.
const TEXT_POLICY: &str = "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Adds security headers that browsers obey.
///
/// No body is taken for another media type than its own. HTML pages cannot be framed, load nothing from
/// elsewhere, and send no referrer.
fn secure(headers: &mut HeaderMap) {
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    let media_type = headers.get(header::CONTENT_TYPE).map_or(&b""[..], HeaderValue::as_bytes);
    if media_type.starts_with(b"text/html") {
        headers.entry(header::CONTENT_SECURITY_POLICY).or_insert(HeaderValue::from_static(TEXT_POLICY));
        headers.insert(header::X_FRAME_OPTIONS, HeaderValue::from_static("DENY"));
        headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    }
}

/// Assigns the request id, passes the request on, writes the problem document if there is one, and logs a
/// line.
///
/// Problem documents contain the request id. The line has method, path and status, never a body: clouds stay
/// out of the log.
pub async fn name_and_log(State(host): State<Arc<Host>>, mut request: Request, next: Next) -> Response {
    let mut under_way = UnderWay::new(host.clone(), &request);
    let request_id = client_request_id(request.headers()).unwrap_or_else(|| Uuid::now_v7().to_string());
    let method = cut(request.method().as_str(), LOGGED_METHOD_BYTES);
    let path = cut(request.uri().path(), LOGGED_PATH_BYTES);
    let route = request.extensions().get::<MatchedPath>().map(MatchedPath::as_str);
    let span = RequestSpan::begin(request.method(), route, request.headers());
    request.extensions_mut().insert(span.as_parent());
    let subject = named_subject(&host, &request);
    let response = transport::answer(&host, request, next).await;
    if let Some(problem) = response.extensions().get::<Problem>() {
        host.metrics.refused(problem.slug());
    }
    if let Some(&outcome) = response.extensions().get::<CacheOutcome>() {
        host.metrics.cached(outcome);
    }
    let mut response = with_problem_document(response, &request_id);
    secure(response.headers_mut());
    if let Some((header, id)) = subject {
        response.headers_mut().entry(header).or_insert(id);
    }
    if let Ok(value) = HeaderValue::from_str(&request_id) {
        response.headers_mut().insert("x-request-id", value);
    }
    let duration_ms = under_way.answered(response.status()).as_secs_f64() * 1e3;
    let status = response.status().as_u16();
    let cache = response.headers().get("cache-status").and_then(|value| value.to_str().ok()).unwrap_or("-");
    let trace_id = span.trace_id();
    span.end(response.status(), response.headers());
    let key = response.extensions().get::<KeyName>().map_or("-", |name| &name.0);
    tracing::info!(
        request_id,
        trace_id,
        key,
        method,
        path,
        status,
        duration_ms,
        cache,
        "{method} {path} {status}"
    );
    response
}

/// Id of the subject of a request, from its header or its path. The answer repeats the id for proxies.
fn named_subject(host: &Host, request: &Request) -> Option<(HeaderName, HeaderValue)> {
    let Subject { header, path, is_id } = host.guest.subject.as_ref()?;
    let is_id = |text: &&str| is_id(text);
    let in_head = request.headers().get(header).and_then(|value| value.to_str().ok()).filter(is_id);
    let in_path = || request.uri().path().strip_prefix(path).filter(is_id);
    let id = HeaderValue::from_str(in_head.or_else(in_path)?).ok()?;
    Some((header.clone(), id))
}

/// Truncates a text and marks the cut with "…".
fn cut(text: &str, n_bytes: usize) -> String {
    if text.len() <= n_bytes {
        return text.to_owned();
    }
    let end = (0..=n_bytes).rev().find(|&end| text.is_char_boundary(end)).unwrap_or(0);
    format!("{}…", &text[..end])
}

/// Counts a request as in progress until dropped, which also happens when its client leaves.
struct UnderWay {
    host: Arc<Host>,
    began: Instant,
    method: Method,
    route: Option<MatchedPath>,
    status: Option<StatusCode>,
}

impl UnderWay {
    fn new(host: Arc<Host>, request: &Request) -> Self {
        host.n_requests.fetch_add(1, Ordering::Relaxed);
        host.metrics.arrived();
        let route = request.extensions().get::<MatchedPath>().cloned();
        Self { host, began: Instant::now(), method: request.method().clone(), route, status: None }
    }

    /// Records the status of the answer. Returns the time since the request arrived.
    fn answered(&mut self, status: StatusCode) -> Duration {
        self.status = Some(status);
        self.began.elapsed()
    }
}

impl Drop for UnderWay {
    fn drop(&mut self) {
        self.host.n_requests.fetch_sub(1, Ordering::Relaxed);
        let route = self.route.as_ref().map(MatchedPath::as_str);
        self.host.metrics.left(&self.method, route, self.status, self.began.elapsed());
    }
}

/// The client's own request id, if it is short and safe in logs and headers.
fn client_request_id(headers: &HeaderMap) -> Option<String> {
    let id = headers.get("x-request-id")?.to_str().ok()?;
    let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    (!id.is_empty() && id.len() <= 128 && id.chars().all(is_plain)).then(|| id.to_owned())
}

/// Writes the problem document of an error, including errors made by a library. Keeps the other headers.
pub fn with_problem_document(response: Response, request_id: &str) -> Response {
    let status = response.status();
    if !status.is_client_error() && !status.is_server_error() {
        return response;
    }
    let problem = match response.extensions().get::<Problem>() {
        Some(problem) => problem.clone(),
        None => match response.extensions().get::<StoredProblem>() {
            Some(StoredProblem(document)) => return written_before(status, document, request_id),
            None => foreign(status),
        },
    };
    let mut documented = problem.to_response(request_id);
    for (name, value) in response.headers() {
        if name != header::CONTENT_TYPE && name != header::CONTENT_LENGTH {
            documented.headers_mut().append(name, value.clone());
        }
    }
    documented
}

/// A complete problem document. An extension of its answer.
#[derive(Clone)]
pub struct StoredProblem(pub serde_json::Value);

/// Returns a stored problem document with the id of the current request.
fn written_before(status: StatusCode, document: &serde_json::Value, request_id: &str) -> Response {
    let mut document = document.clone();
    document["instance"] = request_id.into();
    let media_type = [(header::CONTENT_TYPE, "application/problem+json")];
    (status, media_type, document.to_string()).into_response()
}

/// The problem for an error that a library made.
fn foreign(status: StatusCode) -> Problem {
    match status {
        // axum answers 400 if a path is not UTF-8 once decoded.
        StatusCode::NOT_FOUND | StatusCode::BAD_REQUEST => Problem::not_found(),
        StatusCode::METHOD_NOT_ALLOWED => Problem::new(catalogue::METHOD_NOT_ALLOWED, "see the Allow header"),
        StatusCode::UNSUPPORTED_MEDIA_TYPE => {
            Problem::new(catalogue::UNSUPPORTED_MEDIA_TYPE, "send application/json")
        }
        _ if status.is_client_error() => {
            Problem::new(catalogue::INVALID_REQUEST, "the request cannot be read")
        }
        _ => Problem::internal(),
    }
}

pub async fn not_found() -> Problem {
    Problem::not_found()
}

pub async fn method_not_allowed() -> Problem {
    Problem::new(catalogue::METHOD_NOT_ALLOWED, "this path does not have this method; see the Allow header")
}

/// Answers a panic, which is a bug. The panic hook has logged it, and the answer has no details.
pub fn recover(_panic: Box<dyn Any + Send + 'static>) -> Response {
    Problem::internal().into_response()
}

/// Refuses requests that do not accept JSON, for routes that offer nothing else.
///
/// HEAD and DELETE are exempt: their success has no body. Generated clients then list only the media type of
/// problems, which are sent whatever the client accepts.
pub async fn negotiate(request: Request, next: Next) -> Response {
    if matches!(*request.method(), Method::HEAD | Method::DELETE) {
        return next.run(request).await;
    }
    match AnswerEncoding::of(request.headers(), &[Format::Json]) {
        Ok(_) => next.run(request).await,
        Err(problem) => problem.into_response(),
    }
}

/// Answers 504 when the deadline passes. Dropping the handler cancels its work.
pub async fn meet_deadline(State(host): State<Arc<Host>>, request: Request, next: Next) -> Response {
    let deadline = host.settings.deadline();
    match tokio::time::timeout(deadline, next.run(request)).await {
        Ok(response) => response,
        Err(_) => {
            let detail = format!("no answer within {} s; the work was cancelled", deadline.as_secs_f64());
            Problem::new(catalogue::DEADLINE_EXCEEDED, detail).into_response()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_texts_are_cut_between_characters() {
        assert_eq!(cut("/v1", 3), "/v1");
        assert_eq!(cut("/v1/", 3), "/v1…");
        assert_eq!(cut("ää", 3), "ä…");
    }

    #[test]
    fn only_harmless_request_ids_are_taken_over() {
        let with = |id: &str| {
            let mut headers = HeaderMap::new();
            headers.insert("x-request-id", HeaderValue::from_str(id).unwrap());
            client_request_id(&headers)
        };
        assert_eq!(with("trace-1.a_b"), Some("trace-1.a_b".to_owned()));
        assert_eq!(with("a b"), None);
        assert_eq!(with(&"x".repeat(129)), None);
    }
}
