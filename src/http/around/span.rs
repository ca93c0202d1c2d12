//! OpenTelemetry spans of requests and jobs. Without a collector (telemetry.rs) they have no effect.

use std::fmt::Display;

use axum::http::{HeaderMap, Method, StatusCode};
use opentelemetry::global::{self, BoxedSpan};
use opentelemetry::trace::{
    Span, SpanContext, SpanId, SpanKind, Status, TraceContextExt, TraceFlags, TraceId, TraceState, Tracer,
};
use opentelemetry::{Context, KeyValue};
use uuid::Uuid;

use super::trace::TraceParent;
use crate::http::metrics::method_label;

/// The span of a request, or of work on a job, in the trace of the client if it has one.
pub struct RequestSpan {
    span: BoxedSpan,
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
        let attributes =
            vec![KeyValue::new("http.request.method", method), KeyValue::new("http.route", route)];
        Self::new(name, SpanKind::Server, attributes, TraceParent::of(headers))
    }

    /// Begins the span of work on a job for a route, in the trace of the request that created the job.
    pub fn begin_job(id: &impl Display, route: &str, headers: &HeaderMap) -> Self {
        let attributes =
            vec![KeyValue::new("gramian.job", id.to_string()), KeyValue::new("http.route", route.to_owned())];
        Self::new(format!("job {route}"), SpanKind::Consumer, attributes, TraceParent::of(headers))
    }

    fn new(name: String, kind: SpanKind, attributes: Vec<KeyValue>, parent: Option<TraceParent>) -> Self {
        let context = match &parent {
            Some(parent) => Context::new().with_remote_span_context(context_of(parent)),
            None => Context::new(),
        };
        let tracer = global::tracer("gramian");
        let builder = tracer.span_builder(name).with_kind(kind).with_attributes(attributes);
        let span = tracer.build_with_context(builder, &context);
        let own = Some(span.span_context()).filter(|context| context.is_valid());
        let own = own.map(|context| u128::from_be_bytes(context.trace_id().to_bytes()));
        let trace_id = own.or(parent.as_ref().map(|parent| parent.trace_id));
        Self { span, trace_id: trace_id.unwrap_or_else(|| Uuid::new_v4().as_u128()), parent }
    }

    /// The parent for later work of the same trace.
    ///
    /// It is this span. Without a collector it is the client's span.
    pub fn as_parent(&self) -> TraceParent {
        let own = self.span.span_context();
        if own.is_valid() {
            let span_id = u64::from_be_bytes(own.span_id().to_bytes());
            return TraceParent { trace_id: self.trace_id, span_id, is_sampled: own.is_sampled() };
        }
        let invented = || TraceParent { trace_id: self.trace_id, span_id: 1, is_sampled: true };
        self.parent.clone().unwrap_or_else(invented)
    }

    /// The trace id, as 32 hexadecimal digits.
    pub fn trace_id(&self) -> String {
        format!("{:032x}", self.trace_id)
    }

    /// Ends the span with the answer. A span dropped before has ended as well, because its client left.
    pub fn end(mut self, status: StatusCode, headers: &HeaderMap) {
        self.span.set_attribute(KeyValue::new("http.response.status_code", i64::from(status.as_u16())));
        let text = |name: &str| headers.get(name).and_then(|value| value.to_str().ok()).map(str::to_owned);
        for (header, attribute) in [
            ("x-request-id", "gramian.request_id"),
            ("cache-status", "gramian.cache_status"),
            ("server-timing", "gramian.server_timing"),
            ("gramian-cloud", "gramian.cloud"),
        ] {
            if let Some(text) = text(header) {
                self.span.set_attribute(KeyValue::new(attribute, text));
            }
        }
        if status.is_server_error() {
            self.span.set_status(Status::error(status.to_string()));
        }
        self.span.end();
    }
}

fn context_of(parent: &TraceParent) -> SpanContext {
    let flags = if parent.is_sampled { TraceFlags::SAMPLED } else { TraceFlags::NOT_SAMPLED };
    let (trace_id, span_id) = (
        TraceId::from_bytes(parent.trace_id.to_be_bytes()),
        SpanId::from_bytes(parent.span_id.to_be_bytes()),
    );
    SpanContext::new(trace_id, span_id, flags, true, TraceState::default())
}
