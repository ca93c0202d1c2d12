//! Reasons why there is no answer, and the exit codes of each.

use std::fmt;

use axum::http::StatusCode;
use serde_json::Value;
use tokio::signal::unix::SignalKind;

/// The reason why there is no answer.
#[derive(Debug)]
pub enum Failure {
    /// An argument is not as it should be.
    Argument(String),
    /// A file cannot be read or written.
    File(String),
    /// A signal told the process to end.
    Ended(SignalKind),
    /// The service refused the request, or failed, with the problem document.
    Problem(StatusCode, Value),
    /// A problem in words, with its exit code.
    Told(u8, String),
}

impl Failure {
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::File(_) => 1,
            Self::Argument(_) => 2,
            // Shells report 128 plus the number of the signal.
            Self::Ended(signal) => 128 + signal.as_raw_value() as u8,
            Self::Problem(status, _) if status.is_client_error() => 3,
            Self::Problem(..) => 4,
            Self::Told(code, _) => *code,
        }
    }

    /// Tells a problem in other words. Failures of other kinds are in words already.
    pub fn in_words(self, tell: impl FnOnce(&Value) -> String) -> Self {
        let code = self.exit_code();
        match self {
            Self::Problem(_, document) => Self::Told(code, tell(&document)),
            other => other,
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Argument(text) | Self::File(text) | Self::Told(_, text) => formatter.write_str(text),
            Self::Ended(signal) => write!(formatter, "ended by signal {}", signal.as_raw_value()),
            Self::Problem(_, document) => {
                formatter.write_str(document["detail"].as_str().unwrap_or_default())
            }
        }
    }
}
