//! From the answer to the response.

use axum::response::Response;

use super::{AnswerHeaders, Call};
use crate::memory::budget::Reservation;
use crate::wire::write::encode::EncodedAnswer;

/// An encoded answer with its memory, ready to be sent.
pub struct Answer {
    pub encoded: EncodedAnswer,
    pub memory: Reservation,
    pub headers: AnswerHeaders,
}

impl Answer {
    /// Gives the place of the request back, and returns the response.
    pub fn respond(self, call: &Call) -> Response {
        let Self { encoded, memory, headers } = self;
        call.admission.finish();
        headers.head(encoded.into_response(&call.host.compute, memory))
    }
}
