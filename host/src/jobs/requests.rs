//! Requests about jobs: deleted, followed, and their results fetched.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::Extension;
use axum::body::Body;
use axum::http::{StatusCode, header};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures_util::Stream;

use super::look::{JobView, find_known, look, look_until_ended, problem_of};
use super::{restore_headers, unknown_job};
use crate::around::middleware::StoredProblem;
use crate::memory::Owner;
use crate::memory::budget::Reservation;
use crate::problem::{Problem, catalogue};
use crate::state::host::Host;
use crate::store::changes::{SECONDS_UNTIL_BACK, unavailable};
use crate::store::jobs::{JobId, Outcome};
use crate::wire::write::encode::holding;
use crate::wire::write::json;

/// Interval at which a followed job is checked for progress.
const TELLING: Duration = Duration::from_millis(500);

/// Time by which a wait for a result ends before the deadline of its request.
const MARGIN: Duration = Duration::from_secs(1);

/// Parses the id of a job.
///
/// # Errors
/// 404 for any other text.
pub fn parse(job_id: &str) -> Result<JobId, Problem> {
    JobId::parse(job_id).ok_or_else(|| unknown_job(job_id))
}

/// Cancels a job that has not ended, or deletes one that has, with its result.
///
/// # Errors
/// 404 for an unknown job, and 503 if the store does not answer.
pub async fn delete(host: &Host, owner: Owner, id: JobId) -> Result<(), Problem> {
    let name = host.keys.name_of(owner);
    let refused = |error| unavailable(&error);
    let job = find_known(host, &name, id).await?;
    let is_cancelled = job.ended_at.is_none() && host.jobs.cancel(owner, &name, id).await.map_err(refused)?;
    // Another request may have deleted the job meanwhile.
    if is_cancelled || host.jobs.forget(&name, id).await.map_err(refused)? {
        Ok(())
    } else {
        Err(unknown_job(&id.to_string()))
    }
}

/// Sends an event whenever a job is further than before, and a last one when it has ended.
///
/// # Errors
/// Returns the errors of [`look`], and 503 if too many clients follow jobs.
pub async fn follow(
    host: Arc<Host>,
    owner: Owner,
    id: JobId,
) -> Result<Sse<impl Stream<Item = Result<Event, Infallible>>>, Problem> {
    let first = look(&host, owner, id).await?;
    let followed = take_place(&host, owner)?;
    let events = futures_util::stream::unfold(Following::First(Box::new(first)), move |following| {
        // The client counts as a follower until the stream ends.
        let _ = &followed;
        let host = host.clone();
        async move {
            let view = match following {
                Following::First(view) => *view,
                Following::Further(last) => further(&host, owner, id, &last).await?,
                Following::Ended => return None,
            };
            let name = if view.has_ended() { "done" } else { "progress" };
            let text = String::from_utf8(json::to_vec(&view).ok()?).ok()?;
            let event = Event::default().event(name).data(text);
            let next = if view.has_ended() { Following::Ended } else { Following::Further(Box::new(view)) };
            Some((Ok(event), next))
        }
    });
    Ok(Sse::new(events).keep_alive(KeepAlive::default()))
}

/// The next event for a client that follows a job.
enum Following {
    First(Box<JobView>),
    Further(Box<JobView>),
    Ended,
}

/// Waits until a job differs from its last view, and returns the new view.
///
/// Returns `None` if the job is gone or this process shuts down. The stream then ends, and the client asks
/// again.
async fn further(host: &Host, owner: Owner, id: JobId, last: &JobView) -> Option<JobView> {
    loop {
        tokio::select! {
            () = tokio::time::sleep(TELLING) => {}
            () = host.jobs.until_over(id) => {}
            () = host.draining.cancelled() => return None,
        }
        let view = look(host, owner, id).await.ok()?;
        if view != *last {
            return Some(view);
        }
    }
}

/// The answer of a job once it has ended: that of its request, problems included.
///
/// # Errors
/// Returns the errors of [`look`], 404 for a cancelled job, 503 if too many clients wait, and 504 if the job
/// does not end in time.
pub async fn result(host: &Host, owner: Owner, id: JobId) -> Result<Response, Problem> {
    let first = look(host, owner, id).await?;
    // A waiting client holds its connection as long as a follower does, so it counts as one.
    let waiting = if first.has_ended() { None } else { Some(take_place(host, owner)?) };
    let deadline = host.settings.deadline();
    let timeout = deadline.saturating_sub(MARGIN).max(deadline / 2);
    let ended = tokio::time::timeout(timeout, look_until_ended(host, owner, id)).await;
    let detail = "the job has not ended; request its result again later";
    ended.map_err(|_| Problem::new(catalogue::DEADLINE_EXCEEDED, detail))??;
    drop(waiting);
    let name = host.keys.name_of(owner);
    let found = host.jobs.objects.get_result(&name, id).await.map_err(|error| unavailable(&error))?;
    let Some(found) = found else {
        // Either the job was deleted meanwhile, which is 404 here, or its result was damaged.
        find_known(host, &name, id).await?;
        return Err(Problem::unavailable(
            "the stored result was damaged and is being computed again",
            SECONDS_UNTIL_BACK,
        ));
    };
    if found.head.outcome == Outcome::Cancelled {
        return Err(Problem::new(catalogue::UNKNOWN_JOB, "the job was cancelled and has no result"));
    }
    if found.head.outcome == Outcome::Failed {
        let status = StatusCode::from_u16(found.head.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let document = problem_of(found).await?;
        return Ok((status, Extension(StoredProblem(document))).into_response());
    }
    let most = host.jobs.objects.bytes_per_reader();
    let n_bytes = usize::try_from(found.n_body_bytes).unwrap_or(usize::MAX).min(most);
    let memory = host.work.try_reserve(owner, n_bytes).ok_or_else(|| host.compute.out_of_memory())?;
    let mut response = Body::from_stream(holding(found.body, memory)).into_response();
    restore_headers(response.headers_mut(), &found.head.headers);
    response.headers_mut().insert(header::CONTENT_LENGTH, found.n_body_bytes.into());
    Ok(response)
}

/// Takes a place among the clients that follow jobs or wait for them.
fn take_place(host: &Host, owner: Owner) -> Result<Reservation, Problem> {
    host.jobs.follow(owner).ok_or_else(|| host.compute.out_of_memory())
}
