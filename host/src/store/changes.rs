//! Refusals for a store that does not answer, and changes that end even if their client leaves.

use std::future::Future;

use tracing::Instrument;

use super::Unavailable;
use crate::problem::Problem;

/// Seconds after which a client should retry if the store does not answer.
pub const SECONDS_UNTIL_BACK: u64 = 5;

/// Returns 503 for a store that does not answer.
pub fn unavailable(error: &Unavailable) -> Problem {
    tracing::error!(%error, "the store does not answer");
    Problem::unavailable("the store does not answer", SECONDS_UNTIL_BACK)
}

/// Runs a change of the store to its end, even if the client leaves meanwhile. Nobody asked for half a
/// change.
///
/// # Errors
/// Returns the errors of the change, and 500 if it panicked.
pub async fn to_its_end<T: Send + 'static>(
    change: impl Future<Output = Result<T, Problem>> + Send + 'static,
) -> Result<T, Problem> {
    tokio::spawn(change.in_current_span()).await.unwrap_or_else(|_| Err(Problem::internal()))
}
