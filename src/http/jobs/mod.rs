//! Long work as jobs: `Prefer: respond-async` (RFC 7240) is answered 202 at once, and the answer is kept until it is fetched.
//!
//! WHERE. A job is objects in the store (store/objects/jobs/), of which all processes see the same; without a store it is objects in memory,
//! within a part of the budget. What follows needs no second way of doing things.
//!
//! WHO. The process that took a request works on it when its turn has come; as many run at once as there are threads, owner after owner,
//! and half of them at most of one owner of several.
//! A job that nobody works on, or whose process has ended, is anybody's (rounds.rs).
//!
//! BOUNDS (state/kept.rs). The number of kept jobs is bounded, and so are the bytes of their requests and results.
//! When there are several owners, one may have half of each. An owner at its bound is refused. No kept result
//! is dropped to make room, so no owner can push out the results of another, and no result is lost before it
//! is fetched.
//!
//! REPEATED REQUESTS (idempotency.rs). A request that is sent again with its `Idempotency-Key` is answered
//! with the job that it began.
//!
//! HOW. The request goes through the routes as any other (answer.rs), without a deadline. An answer that asks to come back later is not
//! one: the job comes back.

mod accept;
mod answer;
mod idempotency;
mod look;
mod rounds;
mod run;

use std::sync::Arc;

use axum::Router;

use crate::http::problem::Problem;
use crate::http::problem::slug::Slug;
use crate::http::state::app::App;
pub use accept::respond_async;
pub use idempotency::IDEMPOTENCY_KEY;
pub use look::{JobView, Status, find_known, look, look_until_ended, problem_of};

/// What works on jobs: the routes without deadline and keys.
#[derive(Clone)]
pub struct Runner {
    pub app: Arc<App>,
    pub routes: Router,
}

/// 404 for a job that nobody knows.
pub fn unknown_job(id: &str) -> Problem {
    let id: String = id.chars().take(64).collect();
    Problem::new(
        Slug::UnknownJob,
        format!("there is no job {id} for this key: it never was, or is forgotten"),
    )
}
