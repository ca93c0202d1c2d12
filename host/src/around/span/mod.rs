//! Spans of requests and jobs. Without a collector (`telemetry`), or in a build that sends none, they only
//! carry the trace of their client on.

#[cfg(feature = "otlp")]
mod exported;
#[cfg(not(feature = "otlp"))]
#[path = "unexported.rs"]
mod exported;

use std::fmt::Display;

use axum::http::{HeaderMap, Method, StatusCode};
use uuid::Uuid;

use super::trace::TraceParent;
use crate::state::metrics::method_label;
use exported::ExportedSpan;

/// Who waits for the work of a span.
#[derive(Debug, Clone, Copy)]
enum Role {
    /// A client waits for an answer.
    Request,
    /// A job, for which nobody waits.
    Job,
}

/// Attributes of a span, by their names.
type Attributes = Vec<(&'static str, String)>;

/// The span of a request, or of work on a job, in the trace of the client if it has one.
pub struct RequestSpan {
    span: ExportedSpan,
    trace_id: u128,
    parent: Option<TraceParent>,
}

impl RequestSpan {
    /// Begins the span of a request.
    ///
    /// To keep the number of span names small, the route is a template and the method is one that the service
    /// knows.
    pub fn begin(method: &Method, route: Option<&str>, headers: &HeaderMap) -> Self {
        let (method, route) = (method_label(method), route.unwrap_or("other").to_owned());
        let name = format!("{method} {route}");
        let attributes = vec![("http.request.method", method.to_owned()), ("http.route", route)];
        Self::new(name, Role::Request, attributes, TraceParent::of(headers))
    }

    /// Begins the span of work on a job for a route, in the trace of the request that created the job.
    pub fn begin_job(id: &impl Display, route: &str, headers: &HeaderMap) -> Self {
        let attributes = vec![("gramian.job", id.to_string()), ("http.route", route.to_owned())];
        Self::new(format!("job {route}"), Role::Job, attributes, TraceParent::of(headers))
    }

    fn new(name: String, role: Role, attributes: Attributes, parent: Option<TraceParent>) -> Self {
        let span = ExportedSpan::begin(name, role, attributes, parent.as_ref());
        let trace_id = span.context().or_else(|| parent.clone()).map(|known| known.trace_id);
        Self { span, trace_id: trace_id.unwrap_or_else(|| Uuid::new_v4().as_u128()), parent }
    }

    /// The parent for later work of the same trace.
    ///
    /// It is this span. Without a collector it is the client's span.
    pub fn as_parent(&self) -> TraceParent {
        let invented = || TraceParent { trace_id: self.trace_id, span_id: 1, is_sampled: true };
        self.span.context().or_else(|| self.parent.clone()).unwrap_or_else(invented)
    }

    /// The trace id, as 32 hexadecimal digits.
    pub fn trace_id(&self) -> String {
        format!("{:032x}", self.trace_id)
    }

    /// Ends the span with the answer. A span dropped before has ended as well, because its client left.
    pub fn end(self, status: StatusCode, headers: &HeaderMap) {
        let text = |name: &str| headers.get(name).and_then(|value| value.to_str().ok()).map(str::to_owned);
        let told = [
            ("x-request-id", "gramian.request_id"),
            ("cache-status", "gramian.cache_status"),
            ("server-timing", "gramian.server_timing"),
            ("gramian-cloud", "gramian.cloud"),
        ];
        let told = told.into_iter().filter_map(|(header, attribute)| Some((attribute, text(header)?)));
        self.span.end(status, told.collect());
    }
}
