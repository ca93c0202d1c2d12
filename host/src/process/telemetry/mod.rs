//! Logs and traces. Logs are one JSON line per event on standard error. Spans of requests go to an
//! OpenTelemetry collector, if there is one.

#[cfg(feature = "otlp")]
mod spans;
#[cfg(not(feature = "otlp"))]
#[path = "no_spans.rs"]
mod spans;

use tracing::Level;
use tracing_appender::non_blocking::{ErrorCounter, NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// Lines that wait for a slow or stopped reader: some megabytes.
const MAX_WAITING_LINES: usize = 4096;

/// The log, written by a thread of its own. Dropping it writes the waiting lines. No request waits for a
/// reader of the log: a line that finds the queue full is lost and counted.
pub struct Log {
    // Dropped in this order: the log has a line if the last spans could not be sent.
    _spans: Option<spans::Export>,
    _writer: WorkerGuard,
    lost: ErrorCounter,
}

/// OpenTelemetry variables that name a collector. Others set headers (OTEL_EXPORTER_OTLP_HEADERS), sampling
/// (OTEL_TRACES_SAMPLER) and the service name (OTEL_SERVICE_NAME).
const COLLECTORS: [&str; 2] = ["OTEL_EXPORTER_OTLP_ENDPOINT", "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT"];

/// Starts logging at the level of `RUST_LOG`, which may also name levels of single modules. The default is
/// `info`.
///
/// Must be called outside the async runtime: spans are sent by a thread of their own, which blocks on
/// answers.
pub fn start() -> Log {
    let wanted = std::env::var("RUST_LOG").ok().and_then(|levels| levels.parse().ok());
    let filter = wanted.unwrap_or_else(|| Targets::new().with_default(Level::INFO));
    let builder = NonBlockingBuilder::default().buffered_lines_limit(MAX_WAITING_LINES).lossy(true);
    let (lines, writer) = builder.finish(std::io::stderr());
    let lost = lines.error_counter();
    tracing_subscriber::registry().with(fmt::layer().json().with_writer(lines)).with(filter).init();
    let names_collector = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let spans = COLLECTORS.into_iter().any(names_collector).then(spans::start).flatten();
    Log { _spans: spans, _writer: writer, lost }
}

impl Log {
    /// Logs how many lines were lost, if any.
    pub fn mention_losses(&self) {
        let n_lines = self.lost.dropped_lines();
        if n_lines > 0 {
            tracing::warn!(n_lines, "log lines were dropped because the log was not read fast enough");
        }
    }
}
