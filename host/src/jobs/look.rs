//! The description of a job, as clients see it.

use std::sync::Arc;
use std::time::{Duration, SystemTime};

use futures_util::TryStreamExt;
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

use super::unknown_job;
use crate::compute::Snapshot;
use crate::memory::Owner;
use crate::problem::Problem;
use crate::state::host::Host;
use crate::state::jobs::LocalJob;
use crate::state::kept::is_older;
use crate::store::OwnerName;
use crate::store::changes::unavailable;
use crate::store::jobs::{FoundResult, JobId, JobObjects, JobResult, Lease, Outcome};
use crate::text_schema;
use crate::wire::write::json::timestamp;
use gramian_observer::Stage;

text_schema! {
    /// Schema of a job id. Text that is not an id is answered as an unknown job.
    JobIdSchema: "JobId", "^[0-9a-f]{8}-[0-9a-f]{4}-7[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}$",
    "The id of a job: a UUID of version 7, in lower case."
}

/// Longest problem document of a job, in bytes.
const MAX_PROBLEM_BYTES: u64 = 1 << 20;

/// The state of a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[schema(as = JobStatus)]
pub enum Status {
    /// The job waits for its turn.
    Queued,
    /// The job is being computed.
    Running,
    /// The result is ready.
    Succeeded,
    /// The job failed with a problem.
    Failed,
    /// The job was deleted before it ended.
    Cancelled,
}

/// The progress of a job.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = JobProgress)]
pub struct ProgressView {
    /// The current stage: `queued`, `parse`, `gram`, `factor`, `solve`, `evaluate`, or `done` in the end.
    ///
    /// Stages from `parse` to `evaluate` are those of `Server-Timing`.
    stage: String,
    /// The elapsed part of the time that the job is expected to take, from 0 to 1.
    #[schema(minimum = 0.0, maximum = 1.0)]
    fraction: f64,
    /// Relative residual of the last solve. Absent before there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0.0)]
    residual: Option<f64>,
    /// Seconds until the job is done, predicted from what ran on this machine. Absent while unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0.0)]
    seconds_left: Option<f64>,
}

/// A job.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
#[schema(as = Job)]
pub struct JobView {
    /// The id of the job.
    #[schema(value_type = JobIdSchema)]
    job_id: String,
    /// The state of the job.
    pub status: Status,
    /// The progress of the job.
    progress: ProgressView,
    /// The time at which the job was requested, in UTC.
    #[schema(format = DateTime)]
    created_at: String,
    /// The time at which the job ended, in UTC. Absent before.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    ended_at: Option<String>,
    /// The time until which the result is kept, in UTC. Absent before there is a result.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    expires_at: Option<String>,
    /// The problem that made the job fail, and that the request would have been answered with.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<crate::problem::ProblemDocument<'static>>)]
    problem: Option<Value>,
}

/// Describes a job of this process from what the process knows.
pub fn view_of_here(here: &LocalJob) -> JobView {
    let (status, progress) = if here.has_lease() {
        (Status::Running, of_snapshot(here.progress.now()))
    } else {
        (Status::Queued, at("queued", 0.0))
    };
    view(here.id, status, progress)
}

/// Describes a job of an owner, whichever process works on it.
///
/// # Errors
/// 404 `unknown-job`, or 503 if the store does not answer.
pub async fn look(host: &Host, owner: Owner, id: JobId) -> Result<JobView, Problem> {
    // A job that waits here may have been begun by another process.
    if let Some(here) = here_of(host, owner, id).filter(|here| here.has_lease()) {
        return Ok(view_of_here(&here));
    }
    let (objects, name) = (&host.jobs.objects, host.keys.name_of(owner));
    let refused = |error| unavailable(&error);
    let mut job = find_known(host, &name, id).await?;
    if job.ended_at.is_some() {
        if let Some(result) = objects.get_result(&name, id).await.map_err(refused)? {
            return view_of_result(host, id, result).await;
        }
        // The job was deleted meanwhile, or its result was damaged and dropped. In that case it is open
        // again.
        job = find_known(host, &name, id).await?;
    }
    let lease = match job.lease {
        Some((attempt, _)) => objects.get_lease(&name, id, attempt).await.map_err(refused)?,
        None => None,
    };
    Ok(match lease.filter(|lease| !lease.is_released) {
        Some(lease) => view(id, Status::Running, of_lease(lease)),
        None => view(id, Status::Queued, at("queued", 0.0)),
    })
}

/// The objects of a job, unless it was deleted or its result is older than results are kept.
///
/// # Errors
/// 404 `unknown-job`, or 503 if the store does not answer.
pub async fn find_known(host: &Host, owner: &OwnerName, id: JobId) -> Result<JobObjects, Problem> {
    let found = host.jobs.objects.find_job(owner, id).await.map_err(|error| unavailable(&error))?;
    let is_old = |job: &JobObjects| is_older(job.ended_at, host.settings.job_result(), SystemTime::now());
    found.filter(|job| job.is_known() && !is_old(job)).ok_or_else(|| unknown_job(&id.to_string()))
}

/// Finds a job of this process, if it belongs to the owner.
pub fn here_of(host: &Host, owner: Owner, id: JobId) -> Option<Arc<LocalJob>> {
    host.jobs.find(id).filter(|here| here.owner == owner)
}

/// Waits until a job has ended, and describes it.
///
/// # Errors
/// Returns the errors of [`look`], and 503 if this process shuts down before. Another process then continues
/// the job, and can be asked.
pub async fn look_until_ended(host: &Host, owner: Owner, id: JobId) -> Result<JobView, Problem> {
    loop {
        if let Some(here) = here_of(host, owner, id) {
            here.over.cancelled().await;
        }
        let view = look(host, owner, id).await?;
        if view.has_ended() {
            return Ok(view);
        }
        if host.draining.is_cancelled() {
            return Err(Problem::draining());
        }
        tokio::select! {
            () = tokio::time::sleep(LOOKING) => {}
            () = host.draining.cancelled() => {}
        }
    }
}

/// Interval between two looks at a job of another process.
pub const LOOKING: Duration = Duration::from_secs(1);

impl JobView {
    pub fn id(&self) -> &str {
        &self.job_id
    }

    pub fn has_ended(&self) -> bool {
        !matches!(self.status, Status::Queued | Status::Running)
    }
}

/// Returns the problem document of a job that failed.
///
/// # Errors
/// 500 if the document cannot be read.
pub async fn problem_of(found: FoundResult) -> Result<Value, Problem> {
    let unreadable = |error: &dyn std::fmt::Display| {
        tracing::error!(%error, "the problem of a job cannot be read");
        Problem::internal()
    };
    if found.n_body_bytes > MAX_PROBLEM_BYTES {
        return Err(unreadable(&"it is too long"));
    }
    let bytes: Vec<_> = found.body.try_collect().await.map_err(|error| unreadable(&error))?;
    serde_json::from_slice(&bytes.concat()).map_err(|error| unreadable(&error))
}

async fn view_of_result(host: &Host, id: JobId, found: FoundResult) -> Result<JobView, Problem> {
    let FoundResult { head: JobResult { outcome, .. }, ended_at, .. } = found;
    let status = match outcome {
        Outcome::Succeeded => Status::Succeeded,
        Outcome::Failed => Status::Failed,
        Outcome::Cancelled => Status::Cancelled,
    };
    let fraction = if outcome == Outcome::Succeeded { 1.0 } else { 0.0 };
    let mut view = view(id, status, at("done", fraction));
    view.ended_at = Some(timestamp(ended_at));
    view.expires_at = Some(timestamp(ended_at + host.settings.job_result()));
    if outcome == Outcome::Failed {
        view.problem = Some(problem_of(found).await?);
    }
    Ok(view)
}

fn view(id: JobId, status: Status, progress: ProgressView) -> JobView {
    let created_at = timestamp(id.created_at());
    JobView {
        job_id: id.to_string(),
        status,
        progress,
        created_at,
        ended_at: None,
        expires_at: None,
        problem: None,
    }
}

fn at(stage: &str, fraction: f64) -> ProgressView {
    ProgressView { stage: stage.to_owned(), fraction, residual: None, seconds_left: None }
}

fn of_snapshot(now: Snapshot) -> ProgressView {
    let Snapshot { stage, fraction, residual, seconds_left } = now;
    ProgressView { stage: name_of(stage).to_owned(), fraction, residual, seconds_left }
}

fn of_lease(lease: Lease) -> ProgressView {
    let Lease { stage, fraction, residual, seconds_left, .. } = lease;
    ProgressView {
        stage: stage.unwrap_or_else(|| name_of(None).to_owned()),
        fraction,
        residual,
        seconds_left,
    }
}

/// The name of a stage, as in `Server-Timing`.
pub fn name_of(stage: Option<Stage>) -> &'static str {
    match stage {
        None => "parse",
        Some(Stage::Gram) => "gram",
        Some(Stage::Factor | Stage::Condition) => "factor",
        Some(Stage::Solve) => "solve",
        Some(Stage::Evaluate) => "evaluate",
    }
}
