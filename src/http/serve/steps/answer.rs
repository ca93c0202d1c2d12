//! From the answer to the response.

use std::sync::Arc;

use axum::response::Response;

use super::Call;
use crate::http::serve::durable::keep_all;
use crate::http::serve::report::AnswerHeaders;
use crate::http::wire::write::encode::Encoded;
use crate::store::budget::Reservation;
use crate::store::clouds::RegisteredCloud;

/// An encoded answer with its memory, ready to be sent.
pub struct Answer {
    pub encoded: Encoded,
    pub memory: Reservation,
    pub report: AnswerHeaders,
    /// Clouds of the request that the store does not have yet.
    pub fresh: Vec<Arc<RegisteredCloud>>,
}

impl Answer {
    pub fn with_fresh(self, fresh: Vec<Arc<RegisteredCloud>>) -> Self {
        Self { fresh, ..self }
    }

    /// Writes new clouds to the store, gives the place of the request back, and returns the response.
    pub async fn respond(self, call: &Call) -> Response {
        let Self { encoded, memory, report, fresh } = self;
        keep_all(&call.app, call.admission.owner, &fresh).await;
        call.admission.finish();
        report.head(encoded.into_response(&call.app.compute, memory))
    }
}
