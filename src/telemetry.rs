//! Logs: one JSON line each, to standard error.

use tracing::Level;
use tracing_appender::non_blocking::{ErrorCounter, NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// Lines that wait for a reader that is slow, or has stopped: some megabytes.
const MAX_WAITING_LINES: usize = 4096;

/// The log, written by a thread of its own until this is dropped, when what still waits is written. No request waits for
/// whoever reads the log: a line that finds too many before it is lost, and counted.
pub struct Log {
    _writer: WorkerGuard,
    lost: ErrorCounter,
}

/// Starts logging at the level of `RUST_LOG`, which may name levels of single modules as well; `info` if absent.
pub fn start() -> Log {
    let wanted = std::env::var("RUST_LOG").ok().and_then(|levels| levels.parse().ok());
    let filter = wanted.unwrap_or_else(|| Targets::new().with_default(Level::INFO));
    let builder = NonBlockingBuilder::default().buffered_lines_limit(MAX_WAITING_LINES).lossy(true);
    let (lines, writer) = builder.finish(std::io::stderr());
    let log = Log { _writer: writer, lost: lines.error_counter() };
    tracing_subscriber::registry().with(fmt::layer().json().with_writer(lines)).with(filter).init();
    log
}

impl Log {
    /// Says how many lines were lost, if any.
    pub fn mention_losses(&self) {
        let n_lines = self.lost.dropped_lines();
        if n_lines > 0 {
            tracing::warn!(n_lines, "lines of this log were lost: it was not read fast enough");
        }
    }
}
