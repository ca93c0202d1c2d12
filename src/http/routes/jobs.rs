//! `/v1/jobs`: requests that were sent with `Prefer: respond-async`.

use std::convert::Infallible;
use std::sync::Arc;

use axum::Extension;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::Response;
use axum::response::sse::{Event, Sse};
use futures_util::Stream;

use crate::http::openapi::responses::{AnyJobProblems, JobProblems, JobResultProblems};
use crate::http::problem::Problem;
use crate::http::state::app::App;
use gramian_host::jobs::requests::{self, parse};
use gramian_host::jobs::{JobIdSchema, JobView, look};
use gramian_host::memory::Owner;
use gramian_host::wire::write::json::Json;

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
    look(&app.host, owner, parse(&job_id)?).await.map(Json)
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
    requests::delete(&app.host, owner, parse(&job_id)?).await.map(|()| StatusCode::NO_CONTENT)
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
    requests::follow(app.host.clone(), owner, parse(&job_id)?).await
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
    requests::result(&app.host, owner, parse(&job_id)?).await
}
