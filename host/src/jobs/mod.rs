//! Long work as jobs: `Prefer: respond-async` (RFC 7240) is answered with 202 at once. The answer is kept
//! to be fetched later.
//!
//! STORAGE. A job is a set of objects in the store (store/objects/jobs/), shared by all processes. Without a
//! store, the objects are in memory, within a part of the budget. All other code is the same in both cases.
//!
//! WORK. The process that accepted a request works on it when its turn has come. As many jobs run at once as
//! there are threads. Turns rotate among the owners. If there are several owners, each gets at most half of
//! the turns. A job that no process works on, or whose process has ended, may be taken up by any process
//! (rounds.rs).
//!
//! BOUNDS (state/kept.rs). The number of kept jobs is bounded, and so are the bytes of their requests and
//! results. When there are several owners, one may have half of each. An owner at its bound is refused. No
//! kept result is dropped to make room, so no owner can push out the results of another, and no result is
//! lost before it is fetched.
//!
//! REPEATED REQUESTS (idempotency.rs). A request that is sent again with its `Idempotency-Key` is answered
//! with the job that it began.
//!
//! EXECUTION. The request passes through the routes like any other (answer.rs), but without a deadline. If
//! the route answers 503, the job tries again.

mod accept;
mod answer;
mod idempotency;
#[cfg(test)]
mod interleavings;
mod look;
pub mod requests;
mod rounds;
mod run;

use std::sync::Arc;

use axum::Router;
use axum::http::{HeaderMap, HeaderName, HeaderValue};

use crate::problem::Problem;
use crate::problem::catalogue;
use crate::state::host::Host;
pub use accept::respond_async;
pub use idempotency::IDEMPOTENCY_KEY;
pub use look::{JobIdSchema, JobView, Status, look};

/// The application with the routes that work on jobs. These routes have no deadline and check no keys.
#[derive(Clone)]
pub struct Runner {
    pub host: Arc<Host>,
    pub routes: Router,
}

/// Returns headers of these names as text, to be kept.
fn kept_headers<'a>(
    headers: &HeaderMap,
    names: impl Iterator<Item = &'a HeaderName>,
) -> impl Iterator<Item = (String, String)> {
    names.filter_map(|name| {
        let text = headers.get(name)?.to_str().ok()?;
        Some((name.as_str().to_owned(), text.to_owned()))
    })
}

/// Inserts headers of a request or an answer that was kept as text.
pub fn restore_headers(headers: &mut HeaderMap, kept: &[(String, String)]) {
    for (name, value) in kept {
        if let (Ok(name), Ok(value)) = (HeaderName::from_bytes(name.as_bytes()), HeaderValue::from_str(value))
        {
            headers.insert(name, value);
        }
    }
}

/// 404 for an unknown job.
pub fn unknown_job(id: &str) -> Problem {
    let id: String = id.chars().take(64).collect();
    Problem::new(
        catalogue::UNKNOWN_JOB,
        format!("this key has no job {id}: it was never created, was deleted, or its result expired"),
    )
}
