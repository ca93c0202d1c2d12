//! Prometheus metrics that are counted as events happen. Gauges are read on demand (routes/gauges.rs).
//!
//! Names and labels are an interface, on which dashboards and alerts are built. `docs/operations.md` lists
//! them. No label contains text sent by clients: routes are those of the router, methods those of HTTP.

use std::time::Duration;

use axum::http::{Method, StatusCode};
use prometheus::proto::MetricFamily;
use prometheus::{
    Encoder, Error, HistogramOpts, HistogramVec, IntCounter, IntCounterVec, IntGauge, Opts, Registry,
    TextEncoder,
};

use crate::memory::CacheOutcome;
use crate::problem::catalogue;
use crate::problem::slug::Slug;
use crate::store::jobs::Outcome;

/// Media type of [`Metrics::text`].
pub const CONTENT_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

/// Bucket bounds of the duration histogram, in seconds. Cached answers take a millisecond, factorizations up
/// to a minute.
const SECONDS: [f64; 16] =
    [0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0, 120.0];

/// Status label of requests whose client left before the answer. No answer has this status.
const ABANDONED: &str = "499";

/// Label of requests without a route, or with a method that no route has.
const OTHER: &str = "other";

/// All counters.
pub struct Metrics {
    registry: Registry,
    requests: IntCounterVec,
    durations: HistogramVec,
    in_flight: IntGauge,
    problems: IntCounterVec,
    rate_limited: IntCounter,
    cache_requests: IntCounterVec,
    jobs: IntCounterVec,
}

impl Metrics {
    /// Registers the metrics.
    ///
    /// # Errors
    /// No error occurs unless two metrics have the same name.
    pub fn new(problems: &[Slug]) -> Result<Self, Error> {
        let registry = Registry::new();
        let counters = |name: &str, help: &str, labels: &[&str]| {
            let counters = IntCounterVec::new(Opts::new(name, help), labels)?;
            registry.register(Box::new(counters.clone())).map(|()| counters)
        };
        let durations = HistogramOpts::new(
            "gramian_http_request_duration_seconds",
            "Time from the head of a request to the head of its answer",
        );
        let durations = HistogramVec::new(durations.buckets(SECONDS.to_vec()), &["method", "route"])?;
        registry.register(Box::new(durations.clone()))?;
        let in_flight = IntGauge::new(
            "gramian_http_requests_in_flight",
            "Requests between their arrival and the head of their answer",
        )?;
        registry.register(Box::new(in_flight.clone()))?;
        let rate_limited = IntCounter::new(
            "gramian_rate_limited_total",
            "Requests refused because their key exceeded its limits",
        )?;
        registry.register(Box::new(rate_limited.clone()))?;
        let metrics = Self {
            requests: counters(
                "gramian_http_requests_total",
                "Requests by status; 499 when the client disconnected before the answer",
                &["method", "route", "status"],
            )?,
            durations,
            in_flight,
            problems: counters("gramian_problems_total", "Refused requests by problem type", &["type"])?,
            rate_limited,
            cache_requests: counters(
                "gramian_cache_requests_total",
                "Answers by cache outcome: hit, miss or collapsed",
                &["outcome"],
            )?,
            jobs: counters("gramian_jobs_ended_total", "Jobs that ended, by status", &["outcome"])?,
            registry,
        };
        metrics.begin_at_zero(problems);
        Ok(metrics)
    }

    /// Creates all known label values, so that rates of events that have not happened yet are 0 instead of
    /// absent.
    fn begin_at_zero(&self, problems: &[Slug]) {
        for slug in problems {
            self.problems.with_label_values(&[slug.as_str()]);
        }
        for outcome in ["hit", "miss", "collapsed"] {
            self.cache_requests.with_label_values(&[outcome]);
        }
        for outcome in ["succeeded", "failed"] {
            self.jobs.with_label_values(&[outcome]);
        }
    }

    /// Counts a request that arrived.
    pub fn arrived(&self) {
        self.in_flight.inc();
    }

    /// Counts a request that was answered. Without a status, its client left before.
    pub fn left(&self, method: &Method, route: Option<&str>, status: Option<StatusCode>, took: Duration) {
        let (method, route) = (method_label(method), route.unwrap_or(OTHER));
        self.in_flight.dec();
        let status = status.as_ref().map_or(ABANDONED, StatusCode::as_str);
        self.requests.with_label_values(&[method, route, status]).inc();
        self.durations.with_label_values(&[method, route]).observe(took.as_secs_f64());
    }

    /// Counts a refusal.
    pub fn refused(&self, slug: Slug) {
        self.problems.with_label_values(&[slug.as_str()]).inc();
        if slug == catalogue::RATE_LIMITED {
            self.rate_limited.inc();
        }
    }

    /// Counts an answer by the origin of its models.
    pub fn cached(&self, outcome: CacheOutcome) {
        let outcome = match outcome {
            CacheOutcome::Hit => "hit",
            CacheOutcome::Collapsed => "collapsed",
            CacheOutcome::Stored | CacheOutcome::NotStored => "miss",
        };
        self.cache_requests.with_label_values(&[outcome]).inc();
    }

    /// Counters of the service, gathered with the others.
    ///
    /// # Errors
    /// No error occurs unless two metrics have the same name.
    pub fn counters(&self, name: &str, help: &str, labels: &[&str]) -> Result<IntCounterVec, Error> {
        let counters = IntCounterVec::new(Opts::new(name, help), labels)?;
        self.registry.register(Box::new(counters.clone())).map(|()| counters)
    }

    /// Counts a job that ended.
    pub fn job_ended(&self, outcome: Outcome) {
        let outcome = if outcome == Outcome::Succeeded { "succeeded" } else { "failed" };
        self.jobs.with_label_values(&[outcome]).inc();
    }

    /// Returns `families` and all metrics in the text format of Prometheus, version 0.0.4.
    ///
    /// # Errors
    /// No error occurs unless a family has no name.
    pub fn text(&self, mut families: Vec<MetricFamily>) -> Result<Vec<u8>, Error> {
        families.extend(self.registry.gather());
        let mut text = Vec::new();
        TextEncoder::new().encode(&families, &mut text)?;
        Ok(text)
    }
}

/// The label of a method: its name if some route has it, else `other`.
pub fn method_label(method: &Method) -> &'static str {
    match *method {
        Method::GET => "GET",
        Method::HEAD => "HEAD",
        Method::POST => "POST",
        Method::DELETE => "DELETE",
        Method::OPTIONS => "OPTIONS",
        _ => OTHER,
    }
}
