//! Response headers that report how an answer came about.

use std::time::Duration;

use axum::http::{HeaderName, HeaderValue};
use axum::response::Response;

use crate::compute::StageTimes;
use crate::memory::CacheOutcome;

/// Times and cache outcome of an answer, for `Server-Timing` and `Cache-Status`.
#[derive(Default)]
pub struct AnswerHeaders {
    parse: Duration,
    stages: StageTimes,
    /// Encoding time, absent if encoding continues while the answer is sent.
    encode: Option<Duration>,
    /// Absent if the answer needed nothing that is kept.
    cache: Option<CacheOutcome>,
    /// Id of the subject of the answer, in the header that the service defines.
    subject: Option<(HeaderName, HeaderValue)>,
}

impl AnswerHeaders {
    /// Starts a report after parsing and planning, which took `parse` including the wait for a turn.
    pub fn parsed_in(parse: Duration) -> Self {
        Self { parse, ..Self::default() }
    }

    /// Names what the answer is about.
    pub fn about(self, subject: Option<(HeaderName, HeaderValue)>) -> Self {
        Self { subject, ..self }
    }

    /// Adds a result that was found, or made in these times. Of two, the costlier outcome counts.
    pub fn found(&mut self, outcome: CacheOutcome, made_in: StageTimes) {
        self.cache = self.cache.max(Some(outcome));
        if outcome != CacheOutcome::Hit {
            self.stages.gram += made_in.gram;
            self.stages.factor += made_in.factor;
        }
    }

    /// Adds times of solving and evaluating.
    pub fn worked(&mut self, times: StageTimes) {
        self.stages.solve += times.solve;
        self.stages.evaluate += times.evaluate;
    }

    /// Adds the times of computing and encoding the answer.
    pub fn computed(&mut self, times: StageTimes, encode: Option<Duration>) {
        self.worked(times);
        self.encode = encode;
    }

    /// Adds the headers to a response.
    pub fn head(&self, mut response: Response) -> Response {
        if let Some(outcome) = self.cache {
            // For the metrics.
            response.extensions_mut().insert(outcome);
            response.headers_mut().insert("cache-status", HeaderValue::from_static(status_of(outcome)));
        }
        let headers = response.headers_mut();
        if let Some((header, id)) = &self.subject {
            headers.insert(header.clone(), id.clone());
        }
        if let Ok(timing) = HeaderValue::from_str(&self.server_timing()) {
            headers.insert("server-timing", timing);
        }
        response
    }

    fn server_timing(&self) -> String {
        let stages = [
            ("parse", Some(self.parse)),
            ("gram", Some(self.stages.gram)),
            ("factor", Some(self.stages.factor)),
            ("solve", Some(self.stages.solve)),
            ("evaluate", Some(self.stages.evaluate)),
            ("encode", self.encode),
        ];
        let entry = |(name, time): (&str, Option<Duration>)| {
            time.map(|time| format!("{name};dur={:.3}", time.as_secs_f64() * 1e3))
        };
        stages.into_iter().filter_map(entry).collect::<Vec<_>>().join(", ")
    }
}

/// The outcome as RFC 9211 writes it.
fn status_of(outcome: CacheOutcome) -> &'static str {
    match outcome {
        CacheOutcome::Hit => "gramian; hit",
        CacheOutcome::Collapsed => "gramian; fwd=miss; collapsed",
        CacheOutcome::Stored => "gramian; fwd=miss; stored",
        CacheOutcome::NotStored => "gramian; fwd=miss",
    }
}
