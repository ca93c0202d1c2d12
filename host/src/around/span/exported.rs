//! Spans of OpenTelemetry.

use axum::http::StatusCode;
use opentelemetry::global::{self, BoxedSpan};
use opentelemetry::trace::{
    Span, SpanContext, SpanId, SpanKind, Status, TraceContextExt, TraceFlags, TraceId, TraceState, Tracer,
};
use opentelemetry::{Context, KeyValue};

use super::{Attributes, Role, TraceParent};

pub struct ExportedSpan(BoxedSpan);

impl ExportedSpan {
    pub fn begin(name: String, role: Role, attributes: Attributes, parent: Option<&TraceParent>) -> Self {
        let context = parent
            .map(context_of)
            .map_or_else(Context::new, |of| Context::new().with_remote_span_context(of));
        let kind = match role {
            Role::Request => SpanKind::Server,
            Role::Job => SpanKind::Consumer,
        };
        let tracer = global::tracer("gramian");
        let builder = tracer.span_builder(name).with_kind(kind).with_attributes(key_values(attributes));
        Self(tracer.build_with_context(builder, &context))
    }

    /// The span as a parent of others. `None` without a collector.
    pub fn context(&self) -> Option<TraceParent> {
        let own = self.0.span_context();
        own.is_valid().then(|| TraceParent {
            trace_id: u128::from_be_bytes(own.trace_id().to_bytes()),
            span_id: u64::from_be_bytes(own.span_id().to_bytes()),
            is_sampled: own.is_sampled(),
        })
    }

    pub fn end(mut self, status: StatusCode, attributes: Attributes) {
        self.0.set_attribute(KeyValue::new("http.response.status_code", i64::from(status.as_u16())));
        self.0.set_attributes(key_values(attributes));
        if status.is_server_error() {
            self.0.set_status(Status::error(status.to_string()));
        }
        self.0.end();
    }
}

fn key_values(attributes: Attributes) -> Vec<KeyValue> {
    attributes.into_iter().map(|(name, value)| KeyValue::new(name, value)).collect()
}

fn context_of(parent: &TraceParent) -> SpanContext {
    let flags = if parent.is_sampled { TraceFlags::SAMPLED } else { TraceFlags::NOT_SAMPLED };
    let (trace_id, span_id) = (
        TraceId::from_bytes(parent.trace_id.to_be_bytes()),
        SpanId::from_bytes(parent.span_id.to_be_bytes()),
    );
    SpanContext::new(trace_id, span_id, flags, true, TraceState::default())
}
