//! RFC 9457 problem documents: every answer with status 400 or above.
//!
//! A service over this host has a catalogue of its own beside that of the host, and members of its own in the
//! documents.

pub mod catalogue;
pub mod slug;

use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde_json::{Map, Value};
use utoipa::ToSchema;

use slug::Slug;

/// A refusal or failure: its type, what happened where, and the remedy.
#[derive(Debug, Clone)]
pub struct Problem {
    slug: Slug,
    detail: String,
    /// Boxed, because every fallible function can return a problem, and few problems have these members.
    members: Box<Members>,
}

/// Members that only some problems have.
#[derive(Debug, Clone, Default)]
struct Members {
    errors: Vec<FieldError>,
    further: Map<String, Value>,
    limit: Option<u64>,
    required: Option<u64>,
    retry_after_seconds: Option<u64>,
}

/// A field of the request that was refused.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct FieldError {
    /// RFC 6901 pointer into the request body, such as `/cloud/points/17/2`. For query parameters, `/<name>`.
    #[schema(example = "/cloud/points/17/2")]
    pub pointer: String,
    /// The reason why the field was refused.
    #[schema(example = "expected a number, found null")]
    pub detail: String,
}

/// A problem document (RFC 9457, `application/problem+json`).
#[derive(Serialize, ToSchema)]
#[schema(as = Problem)]
pub struct ProblemDocument<'a> {
    /// The type of problem: `/problems/<slug>`, which is also served as a page.
    #[schema(format = "uri-reference", example = "/problems/invalid-request")]
    r#type: String,
    /// The type of problem in words, the same for every occurrence.
    title: &'a str,
    /// The HTTP status code of the response.
    #[schema(example = 422)]
    status: u16,
    /// The specifics of this occurrence: what happened, where, and the remedy if there is one.
    detail: &'a str,
    /// The id of the request, as in `X-Request-Id`.
    instance: &'a str,
    /// The fields that were refused.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    #[schema(required = false)]
    errors: &'a [FieldError],
    /// Members that the service adds.
    #[serde(flatten)]
    #[schema(ignore)]
    further: &'a Map<String, Value>,
    /// The limit that was exceeded, in the unit that `detail` names.
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<u64>,
    /// The size that the request would have needed, in the unit of `limit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    required: Option<u64>,
}

/// Seconds after which another instance has replaced one that drains.
const SECONDS_UNTIL_REPLACED: u64 = 1;

impl Problem {
    pub fn new(slug: Slug, detail: impl Into<String>) -> Self {
        Self { slug, detail: detail.into(), members: Box::default() }
    }

    /// A problem of a field. The field repeats the detail.
    pub fn of_field(slug: Slug, pointer: impl Into<String>, detail: impl Into<String>) -> Self {
        Self::new(slug, detail).at(pointer)
    }

    pub fn invalid_request(pointer: impl Into<String>, detail: impl Into<String>) -> Self {
        Self::of_field(catalogue::INVALID_REQUEST, pointer, detail)
    }

    /// A problem that states the limit that was exceeded.
    pub fn beyond(slug: Slug, limit: usize, detail: impl Into<String>) -> Self {
        let mut problem = Self::new(slug, detail);
        problem.members.limit = Some(limit as u64);
        problem
    }

    /// 404 for a path that does not exist.
    pub fn not_found() -> Self {
        Self::new(catalogue::NOT_FOUND, "no such path; /openapi.json lists every path")
    }

    /// 413 for a request whose size in `what` exceeds a limit.
    pub fn too_large(slug: Slug, what: &str, limit: usize, required: Option<usize>) -> Self {
        let needed = required.map(|n| format!(", this request has {n}")).unwrap_or_default();
        let mut problem = Self::beyond(slug, limit, format!("at most {limit} {what} are served{needed}"));
        problem.members.required = required.map(|n| n as u64);
        problem
    }

    /// 503 if no place, memory or thread is free.
    pub fn overloaded(retry_after_seconds: u64) -> Self {
        Self::unavailable("the server is at its limit of simultaneous requests", retry_after_seconds)
    }

    /// 429 beyond a limit of the key.
    pub fn rate_limited(limit: &str, retry_after_seconds: u64) -> Self {
        let detail = format!("this key may make {limit}; try again in {retry_after_seconds} s");
        Self::new(catalogue::RATE_LIMITED, detail).retry_after(retry_after_seconds)
    }

    /// 503 for another reason than a full queue.
    pub fn unavailable(reason: &str, retry_after_seconds: u64) -> Self {
        let detail = format!("{reason}; try again in {retry_after_seconds} s");
        Self::new(catalogue::OVERLOADED, detail).retry_after(retry_after_seconds)
    }

    /// Adds `Retry-After`.
    pub fn retry_after(mut self, seconds: u64) -> Self {
        self.members.retry_after_seconds = Some(seconds);
        self
    }

    /// 503 of a process that is shutting down.
    pub fn draining() -> Self {
        Self::unavailable("the server is shutting down", SECONDS_UNTIL_REPLACED)
    }

    /// 500 that reveals nothing internal: the log has the cause under the request id.
    pub fn internal() -> Self {
        Self::new(catalogue::INTERNAL, "an internal error occurred; the request id identifies it in the logs")
    }

    /// 504 for work that was cancelled. The client that cancelled is gone and reads no answer. The deadline
    /// has an answer of its own.
    pub fn cancelled() -> Self {
        Self::new(catalogue::DEADLINE_EXCEEDED, "the computation was cancelled")
    }

    /// Appends a remedy to the detail, and to the fields that repeat the detail.
    pub fn with_remedy(mut self, remedy: &str) -> Self {
        let detail = format!("{}; {remedy}", self.detail);
        let repeating = self.members.errors.iter_mut().filter(|error| error.detail == self.detail);
        repeating.for_each(|error| error.detail.clone_from(&detail));
        self.detail = detail;
        self
    }

    /// Adds members of the service to the document.
    pub fn with_members(mut self, members: &impl Serialize) -> Self {
        // Members that are no object would be a bug, and are left out.
        if let Ok(Value::Object(members)) = serde_json::to_value(members) {
            self.members.further.extend(members);
        }
        self
    }

    /// Adds fields that were refused for reasons of their own. Equal pointers are listed once.
    pub fn with_fields(mut self, fields: impl IntoIterator<Item = FieldError>) -> Self {
        self.members.errors.extend(fields);
        self.members.errors.dedup_by(|a, b| a.pointer == b.pointer);
        self
    }

    /// The fields that were refused.
    pub fn fields(&self) -> &[FieldError] {
        &self.members.errors
    }

    /// Adds a field with the detail of this problem.
    pub fn at(mut self, pointer: impl Into<String>) -> Self {
        self.members.errors.push(FieldError { pointer: pointer.into(), detail: self.detail.clone() });
        self
    }

    pub fn slug(&self) -> Slug {
        self.slug
    }

    /// Returns the problem document for a request.
    pub fn document<'a>(&'a self, request_id: &'a str) -> ProblemDocument<'a> {
        ProblemDocument {
            r#type: format!("/problems/{}", self.slug.as_str()),
            title: self.slug.title(),
            status: self.slug.status().as_u16(),
            detail: &self.detail,
            instance: request_id,
            errors: &self.members.errors,
            further: &self.members.further,
            limit: self.members.limit,
            required: self.members.required,
        }
    }

    /// Returns the full response, once the id of the request is known.
    pub fn to_response(&self, request_id: &str) -> Response {
        let body = serde_json::to_vec(&self.document(request_id)).unwrap_or_default();
        let mut response = (self.slug.status(), body).into_response();
        let headers = response.headers_mut();
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/problem+json"));
        if let Some(seconds) = self.members.retry_after_seconds {
            headers.insert(header::RETRY_AFTER, seconds.into());
        }
        if self.slug.status() == StatusCode::UNAUTHORIZED {
            headers.insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        response
    }
}

impl IntoResponse for Problem {
    /// Returns an empty response that carries the problem. The middleware writes the document, because it
    /// knows the request id.
    fn into_response(self) -> Response {
        let mut response = self.slug.status().into_response();
        response.extensions_mut().insert(self);
        response
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absent_members_are_left_out_of_the_document() {
        let document = serde_json::to_value(Problem::internal().document("id-1")).unwrap();
        let members: Vec<&String> = document.as_object().unwrap().keys().collect();
        assert_eq!(members, ["type", "title", "status", "detail", "instance"]);
    }
}
