//! `/v1/jobs`: requests that were sent with `Prefer: respond-async`.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::Extension;
use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::{StatusCode, header};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures_util::Stream;

use crate::http::around::middleware::Documented;
use crate::http::fields::schemas::JobIdSchema;
use crate::http::jobs::{
    JobView, find_known, look, look_until_ended, problem_of, restore_headers, unknown_job,
};
use crate::http::openapi::responses::{AnyJobProblems, JobProblems, JobResultProblems};
use crate::http::problem::Problem;
use crate::http::problem::slug::Slug;
use crate::http::serve::durable::{SECONDS_UNTIL_BACK, unavailable};
use crate::http::state::app::App;
use crate::http::wire::write::encode::holding;
use crate::http::wire::write::json::{self, Json};
use crate::store::Owner;
use crate::store::budget::Reservation;
use crate::store::objects::jobs::{JobId, Outcome};

/// Interval at which a followed job is checked for progress.
const TELLING: Duration = Duration::from_millis(500);

/// Time by which a wait for a result ends before the deadline of its request.
const MARGIN: Duration = Duration::from_secs(1);

/// Look at a job
///
/// Returns the state of a job: whether it waits, is being computed or has ended, its progress, and how long
/// it will take.
#[utoipa::path(
    get,
    path = "/v1/jobs/{job_id}",
    tag = "jobs",
    params(("job_id" = JobIdSchema, Path, description = "The id of a job", example = "0193a5e7-8c1d-7b22-9f0e-5d3c6f1a2b4c")),
    responses((status = 200, description = "The job", body = JobView), JobProblems)
)]
pub async fn get_job(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    Path(job_id): Path<String>,
) -> Result<Json<JobView>, Problem> {
    look(&app, owner, parse(&job_id)?).await.map(Json)
}

/// Delete a job
///
/// Cancels a job that has not ended, and its work stops soon. Deletes a job that has ended, with its result.
#[utoipa::path(
    delete,
    path = "/v1/jobs/{job_id}",
    tag = "jobs",
    params(("job_id" = JobIdSchema, Path, description = "The id of a job", example = "0193a5e7-8c1d-7b22-9f0e-5d3c6f1a2b4c")),
    responses((status = 204, description = "Cancelled or forgotten"), AnyJobProblems)
)]
pub async fn delete_job(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    Path(job_id): Path<String>,
) -> Result<StatusCode, Problem> {
    let (id, name) = (parse(&job_id)?, app.keys.name_of(owner));
    let refused = |error| unavailable(&error);
    let job = find_known(&app, &name, id).await?;
    let is_cancelled = job.ended_at.is_none() && app.jobs.cancel(owner, &name, id).await.map_err(refused)?;
    // Another request may have deleted the job meanwhile.
    if is_cancelled || app.jobs.forget(&name, id).await.map_err(refused)? {
        Ok(StatusCode::NO_CONTENT)
    } else {
        Err(unknown_job(&job_id))
    }
}

/// Follow a job
///
/// Sends server-sent events whose data is the job. `progress` is sent whenever the job is further than
/// before. `done` is sent when the job has ended, and is the last event.
#[utoipa::path(
    get,
    path = "/v1/jobs/{job_id}/events",
    tag = "jobs",
    params(("job_id" = JobIdSchema, Path, description = "The id of a job", example = "0193a5e7-8c1d-7b22-9f0e-5d3c6f1a2b4c")),
    responses((status = 200, description = "The events", body = String, content_type = "text/event-stream"), AnyJobProblems)
)]
pub async fn follow_job(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    Path(job_id): Path<String>,
) -> Result<Sse<impl Stream<Item = Result<Event, Infallible>>>, Problem> {
    let id = parse(&job_id)?;
    let first = look(&app, owner, id).await?;
    let followed = follow(&app, owner)?;
    let events = futures_util::stream::unfold(Following::First(Box::new(first)), move |following| {
        // The client counts as a follower until the stream ends.
        let _ = &followed;
        let app = app.clone();
        async move {
            let view = match following {
                Following::First(view) => *view,
                Following::Further(last) => further(&app, owner, id, &last).await?,
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
async fn further(app: &App, owner: Owner, id: JobId, last: &JobView) -> Option<JobView> {
    loop {
        tokio::select! {
            () = tokio::time::sleep(TELLING) => {}
            () = app.jobs.until_over(id) => {}
            () = app.draining.cancelled() => return None,
        }
        let view = look(app, owner, id).await.ok()?;
        if view != *last {
            return Some(view);
        }
    }
}

/// Fetch the result of a job
///
/// Answers as the request of the job would have been answered, problems included. A success is 200 with the
/// media type that the request asked for. Waits for the job to end. If that takes longer than the deadline of
/// requests, the answer is 504, and the job goes on.
#[utoipa::path(
    get,
    path = "/v1/jobs/{job_id}/result",
    tag = "jobs",
    params(("job_id" = JobIdSchema, Path, description = "The id of a job", example = "0193a5e7-8c1d-7b22-9f0e-5d3c6f1a2b4c")),
    responses(
        (status = 200, description = "The answer", content(
            (serde_json::Value = "application/json"),
            (String = "application/x-safetensors"),
            (String = "application/x-npy"),
        )),
        JobResultProblems
    )
)]
pub async fn get_job_result(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    Path(job_id): Path<String>,
) -> Result<Response, Problem> {
    let id = parse(&job_id)?;
    let first = look(&app, owner, id).await?;
    // A waiting client holds its connection as long as a follower does, so it counts as one.
    let waiting = if first.has_ended() { None } else { Some(follow(&app, owner)?) };
    let deadline = app.config.deadline();
    let patience = deadline.saturating_sub(MARGIN).max(deadline / 2);
    let ended = tokio::time::timeout(patience, look_until_ended(&app, owner, id)).await;
    let detail = "the job has not ended; request its result again later";
    ended.map_err(|_| Problem::new(Slug::DeadlineExceeded, detail))??;
    drop(waiting);
    let name = app.keys.name_of(owner);
    let found = app.jobs.objects.get_result(&name, id).await.map_err(|error| unavailable(&error))?;
    let Some(found) = found else {
        // Either the job was deleted meanwhile, which is 404 here, or its result was damaged.
        find_known(&app, &name, id).await?;
        return Err(Problem::unavailable(
            "the stored result was damaged and is being computed again",
            SECONDS_UNTIL_BACK,
        ));
    };
    if found.head.outcome == Outcome::Cancelled {
        return Err(Problem::new(Slug::UnknownJob, "the job was cancelled and has no result"));
    }
    if found.head.outcome == Outcome::Failed {
        let status = StatusCode::from_u16(found.head.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let document = problem_of(found).await?;
        return Ok((status, Extension(Documented(document))).into_response());
    }
    let most = app.jobs.objects.bytes_per_reader();
    let n_bytes = usize::try_from(found.n_body_bytes).unwrap_or(usize::MAX).min(most);
    let memory = app.prepared.try_reserve(owner, n_bytes).ok_or_else(|| app.compute.out_of_memory())?;
    let mut response = Body::from_stream(holding(found.body, memory)).into_response();
    restore_headers(response.headers_mut(), &found.head.headers);
    response.headers_mut().insert(header::CONTENT_LENGTH, found.n_body_bytes.into());
    Ok(response)
}

/// Takes a place among the clients that follow jobs or wait for them.
fn follow(app: &App, owner: Owner) -> Result<Reservation, Problem> {
    app.jobs.follow(owner).ok_or_else(|| app.compute.out_of_memory())
}

fn parse(job_id: &str) -> Result<JobId, Problem> {
    JobId::parse(job_id).ok_or_else(|| unknown_job(job_id))
}
