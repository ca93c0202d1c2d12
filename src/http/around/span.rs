//! Requests as spans of OpenTelemetry, where somebody collects them (telemetry.rs); nothing otherwise.

use axum::http::{HeaderMap, Method, StatusCode};
use opentelemetry::global::{self, BoxedSpan};
use opentelemetry::trace::{
    Span, SpanContext, SpanId, SpanKind, Status, TraceContextExt, TraceFlags, TraceId, TraceState, Tracer,
};
use opentelemetry::{Context, KeyValue};
use uuid::Uuid;

use super::trace::TraceParent;
use crate::http::metrics::method_label;

/// The span of a request, in the trace of its client if that has one.
pub struct RequestSpan {
    span: BoxedSpan,
    trace_id: u128,
}

impl RequestSpan {
    /// Begins it. The route is a template and the method one of those that the service has, so that there are few names.
    pub fn begin(method: &Method, route: Option<&str>, headers: &HeaderMap) -> Self {
        let parent = TraceParent::of(headers);
        let context = match &parent {
            Some(parent) => Context::new().with_remote_span_context(context_of(parent)),
            None => Context::new(),
        };
        let (method, route) = (method_label(method), route.unwrap_or("other"));
        let tracer = global::tracer("gramian");
        let builder = tracer.span_builder(format!("{method} {route}")).with_kind(SpanKind::Server);
        let attributes =
            [KeyValue::new("http.request.method", method), KeyValue::new("http.route", route.to_owned())];
        let span = tracer.build_with_context(builder.with_attributes(attributes), &context);
        let own = Some(span.span_context()).filter(|context| context.is_valid());
        let own = own.map(|context| u128::from_be_bytes(context.trace_id().to_bytes()));
        let trace_id = own.or(parent.map(|parent| parent.trace_id));
        Self { span, trace_id: trace_id.unwrap_or_else(|| Uuid::new_v4().as_u128()) }
    }

    /// The name of its trace, 32 digits.
    pub fn trace_id(&self) -> String {
        format!("{:032x}", self.trace_id)
    }

    /// Ends it with its answer. One that is dropped without ends as well: its client has left.
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
