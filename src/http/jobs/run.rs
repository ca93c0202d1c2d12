//! Working on a job.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::Request;
use axum::http::{HeaderName, HeaderValue, Method, StatusCode, header};
use axum::response::{IntoResponse, Response};
use bytes::Bytes;
use futures_util::StreamExt;
use tower::ServiceExt;

use super::look::name_of;
use super::{Here, Runner};
use crate::http::around::middleware::{CLOUD_HEADER, with_problem_document};
use crate::http::problem::Problem;
use crate::http::problem::slug::Slug;
use crate::store::objects::jobs::{JobRequest, JobResult, Lease, Outcome};
use crate::store::objects::{OwnerName, Unavailable};

/// How often a lease is written again, and how long it holds after that.
pub(super) const RENEWING: Duration = Duration::from_secs(2);
pub(super) const EXPIRING: Duration = Duration::from_secs(10);

/// Attempts that may end with their process: a request that ends a process is not given to all of them, one after the other.
const MAX_CRASHES: u32 = 3;

/// How long a job that was told to come back stays away, unless it was told.
const AWAY: Duration = Duration::from_secs(1);

/// What the result of a job takes over of the head of its answer.
static KEPT_HEADERS: [HeaderName; 5] = [
    header::CONTENT_TYPE,
    header::CONTENT_ENCODING,
    HeaderName::from_static("cache-status"),
    HeaderName::from_static("server-timing"),
    CLOUD_HEADER,
];

/// How work on a job ended.
enum Ended {
    /// Its result is there, whoever wrote it.
    Done,
    /// The process is to end: another one may go on.
    Released(u32, Lease),
}

impl Runner {
    /// Works on a job of this process when its turn has come.
    pub(super) async fn run(self, here: Arc<Here>) {
        let name = self.app.keys.name_of(here.owner);
        let jobs = &self.app.jobs;
        match self.attempt(&here, &name).await {
            Ok(Ended::Done) => {}
            Ok(Ended::Released(attempt, lease)) => {
                let lease = Lease { is_released: true, ..lease };
                if let Err(error) = jobs.objects.renew_lease(&name, here.id, attempt, &lease).await {
                    tracing::warn!(job = %here.id, %error, "a job is left until its lease has expired");
                }
            }
            // Its lease expires, and it is begun again: here or elsewhere.
            Err(error) => tracing::error!(job = %here.id, %error, "a job is put off"),
        }
        jobs.remove(&here);
    }

    async fn attempt(&self, here: &Here, name: &OwnerName) -> Result<Ended, Unavailable> {
        let (app, jobs) = (&self.app, &self.app.jobs);
        let _turn = tokio::select! {
            turn = jobs.turns.take(here.owner) => turn,
            () = here.cancelled.cancelled() => return Ok(Ended::Done),
            () = app.draining.cancelled() => return Ok(Ended::Done),
        };
        let found = jobs.objects.find_job(name, here.id).await?;
        let Some(job) = found.filter(|job| job.has_request && job.ended_at.is_none()) else {
            return Ok(Ended::Done);
        };
        let (attempt, lease) = match job.lease {
            None => (0, Lease::default()),
            Some((last, _)) => {
                let before = jobs.objects.get_lease(name, here.id, last).await?.unwrap_or_default();
                let n_crashes = before.n_crashes + u32::from(!before.is_released);
                (last + 1, Lease { n_crashes, ..Lease::default() })
            }
        };
        if !jobs.objects.claim_job(name, here.id, attempt, &lease).await? {
            return Ok(Ended::Done);
        }
        here.is_running.store(true, Ordering::Relaxed);
        if lease.n_crashes >= MAX_CRASHES {
            tracing::error!(job = %here.id, "a job ended its process several times, and is given up");
            return self.write(here, name, Problem::internal().into_response()).await.map(|()| Ended::Done);
        }
        tokio::select! {
            () = here.cancelled.cancelled() => Ok(Ended::Done),
            () = app.draining.cancelled() => Ok(Ended::Released(attempt, lease)),
            () = self.hold_lease(here, name, attempt, &lease) => Ok(Ended::Done),
            answered = self.answer(here, name) => answered.map(|()| Ended::Done),
        }
    }

    /// Says again and again that the job is worked on, until it has a result, which is another's.
    async fn hold_lease(&self, here: &Here, name: &OwnerName, attempt: u32, lease: &Lease) {
        let objects = &self.app.jobs.objects;
        let mut ticks = tokio::time::interval(RENEWING);
        loop {
            ticks.tick().await;
            let now = here.progress.now();
            let lease = Lease {
                stage: Some(name_of(now.stage).to_owned()),
                fraction: now.fraction,
                residual: now.residual,
                seconds_left: now.seconds_left,
                ..lease.clone()
            };
            let written = objects.renew_lease(name, here.id, attempt, &lease).await;
            match (written, objects.has_result(name, here.id).await) {
                (Ok(()), Ok(false)) => {}
                (_, Ok(true)) => return,
                // Another process may take the job up meanwhile, and write the same.
                (Err(error), _) | (_, Err(error)) => {
                    tracing::warn!(job = %here.id, %error, "the lease of a job is not written");
                }
            }
        }
    }

    /// Answers the request, and writes what comes of it.
    async fn answer(&self, here: &Here, name: &OwnerName) -> Result<(), Unavailable> {
        let began = Instant::now();
        let app = &self.app;
        let within = app.config.job_seconds;
        let answering = self.response(here, name);
        let response = match tokio::time::timeout(Duration::from_secs_f64(within), answering).await {
            Ok(response) => response?,
            Err(_) => {
                let detail = format!("no answer within {within} s; the work was cancelled");
                Problem::new(Slug::DeadlineExceeded, detail).into_response()
            }
        };
        let status = response.status().as_u16();
        if let Some(problem) = response.extensions().get::<Problem>() {
            app.metrics.refused(problem.slug());
        }
        self.write(here, name, response).await?;
        let duration_ms = began.elapsed().as_secs_f64() * 1e3;
        tracing::info!(job = %here.id, status, duration_ms, "job {} {status}", here.id);
        Ok(())
    }

    async fn response(&self, here: &Here, name: &OwnerName) -> Result<Response, Unavailable> {
        let app = &self.app;
        let objects = &app.jobs.objects;
        let n_bytes = objects.job_bytes(name, here.id).await?.unwrap_or_default();
        let mut memory = app.intake.try_reserve(here.owner, 0);
        while let Some(reservation) = &mut memory {
            if app.intake.grow(reservation, usize::try_from(n_bytes).unwrap_or(usize::MAX), AWAY).await {
                break;
            }
        }
        let (request, body) = match objects.get_job(name, here.id).await? {
            Some(Ok(found)) => found,
            Some(Err(damaged)) => {
                tracing::error!(job = %here.id, reason = damaged.0, "a job is damaged");
                return Ok(Problem::internal().into_response());
            }
            // It was deleted.
            None => return Ok(Problem::internal().into_response()),
        };
        loop {
            here.progress.restart();
            let request = rebuilt(&request, body.clone(), here);
            let answering = here.progress.watch(self.routes.clone().oneshot(request));
            let response = answering.await.unwrap_or_else(|never| match never {});
            if response.status() != StatusCode::SERVICE_UNAVAILABLE {
                return Ok(response);
            }
            tokio::time::sleep(AWAY).await;
        }
    }

    /// Writes what the request was answered with.
    async fn write(&self, here: &Here, name: &OwnerName, response: Response) -> Result<(), Unavailable> {
        let jobs = &self.app.jobs;
        if jobs.objects.has_result(name, here.id).await? {
            return Ok(());
        }
        let response = with_problem_document(response, &here.id.to_string());
        let (head, body) = (head_of(&response), response.into_body().into_data_stream());
        let mut n_bytes = 0;
        let mut has_room = true;
        let body = body.map(|piece| {
            let piece = piece.map_err(|error| error.to_string())?;
            n_bytes += piece.len();
            // Where it is in memory, it is copied once all of it is there.
            has_room = jobs.hold(here.id, here.owner, 2 * piece.len());
            if has_room { Ok(piece) } else { Err("there is no memory for the result".to_owned()) }
        });
        let written = jobs.objects.put_result(name, here.id, &head, body).await;
        self.app.metrics.job_ended(if has_room { head.outcome } else { Outcome::Failed });
        if has_room {
            written?;
            jobs.shrink(here.id, n_bytes);
            return Ok(());
        }
        jobs.shrink(here.id, 0);
        let problem = Problem::too_large(
            Slug::ProblemTooLarge,
            "bytes of results are kept in memory: fetch and delete those that are there, or ask for less; the result has more, beyond",
            jobs.memory.as_ref().map_or(0, |memory| memory.largest()),
            None,
        );
        let response = with_problem_document(problem.into_response(), &here.id.to_string());
        let (head, body) = (head_of(&response), response.into_body().into_data_stream());
        jobs.objects.put_result(name, here.id, &head, body).await
    }
}

fn head_of(response: &Response) -> JobResult {
    let kept = KEPT_HEADERS.iter().filter_map(|name| {
        let text = response.headers().get(name)?.to_str().ok()?;
        Some((name.as_str().to_owned(), text.to_owned()))
    });
    let outcome = if response.status().is_success() { Outcome::Succeeded } else { Outcome::Failed };
    JobResult { outcome, status: response.status().as_u16(), headers: kept.collect() }
}

/// The request as its client sent it, with its owner.
fn rebuilt(request: &JobRequest, body: Bytes, here: &Here) -> Request {
    let mut rebuilt = Request::new(Body::from(body));
    *rebuilt.method_mut() = Method::POST;
    if let Ok(uri) = request.path.parse() {
        *rebuilt.uri_mut() = uri;
    }
    for (name, value) in &request.headers {
        if let (Ok(name), Ok(value)) = (HeaderName::from_bytes(name.as_bytes()), HeaderValue::from_str(value))
        {
            rebuilt.headers_mut().insert(name, value);
        }
    }
    rebuilt.extensions_mut().insert(here.owner);
    rebuilt
}
