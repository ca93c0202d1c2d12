//! Response headers that report how an answer came about.

use std::time::Duration;

use axum::http::HeaderValue;
use axum::response::Response;

use crate::http::around::middleware::CLOUD_HEADER;
use crate::http::compute::StageTimes;
use crate::store::key::CloudId;
use crate::store::prepared::{CacheOutcome, PreparedFit};

/// Times and cache outcome of an answer, for `Server-Timing` and `Cache-Status`.
#[derive(Default)]
pub struct AnswerHeaders {
    parse: Duration,
    stages: StageTimes,
    /// Encoding time, absent if encoding continues while the answer is sent.
    encode: Option<Duration>,
    cache: Option<CacheOutcome>,
    /// Cloud of the answer.
    cloud: Option<CloudId>,
}

impl AnswerHeaders {
    /// Starts a report after parsing and planning, which took `parse` including the wait for a turn.
    pub fn parsed_in(parse: Duration, cloud: CloudId) -> Self {
        Self { parse, cloud: Some(cloud), ..Self::default() }
    }

    /// Adds a model. With two models, the answer is a hit only if both are hits: outcomes are ordered by
    /// cost.
    pub fn found(&mut self, stored: &PreparedFit, outcome: CacheOutcome) {
        self.cache = self.cache.max(Some(outcome));
        if outcome != CacheOutcome::Hit {
            self.stages.gram += stored.gram_time;
            self.stages.factor += stored.factor_time;
        }
    }

    /// Adds the stage times of making the surface.
    pub fn made_surface(&mut self, times: StageTimes) {
        self.stages.solve += times.solve;
        self.stages.evaluate += times.evaluate;
    }

    pub fn computed(&mut self, times: StageTimes, encode: Option<Duration>) {
        self.made_surface(times);
        self.encode = encode;
    }

    /// Adds the headers to a response.
    pub fn head(&self, mut response: Response) -> Response {
        let outcome = self.cache.unwrap_or(CacheOutcome::Hit);
        // For the metrics.
        response.extensions_mut().insert(outcome);
        let headers = response.headers_mut();
        let cache = match outcome {
            CacheOutcome::Hit => "gramian; hit",
            CacheOutcome::Collapsed => "gramian; fwd=miss; collapsed",
            CacheOutcome::Stored => "gramian; fwd=miss; stored",
            CacheOutcome::NotStored => "gramian; fwd=miss",
        };
        headers.insert("cache-status", HeaderValue::from_static(cache));
        if let Some(cloud) = self.cloud
            && let Ok(cloud) = HeaderValue::from_str(&cloud.to_string())
        {
            headers.insert(CLOUD_HEADER, cloud);
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
