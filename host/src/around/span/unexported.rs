//! Stands in for `exported.rs` in builds that send no spans.

use axum::http::StatusCode;

use super::{Attributes, Role, TraceParent};

pub struct ExportedSpan;

impl ExportedSpan {
    pub fn begin(_name: String, _role: Role, _attributes: Attributes, _parent: Option<&TraceParent>) -> Self {
        Self
    }

    pub fn context(&self) -> Option<TraceParent> {
        None
    }

    pub fn end(self, _status: StatusCode, _attributes: Attributes) {}
}
