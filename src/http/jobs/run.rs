//! Working on a job.

use std::sync::atomic::Ordering;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::Request;
use axum::http::{HeaderName, HeaderValue, Method, StatusCode, header};
use axum::response::{IntoResponse, Response};
use futures_util::{StreamExt, TryStreamExt};
use tower::ServiceExt;

use super::look::name_of;
use super::{Here, Jobs, Runner};
use crate::http::around::middleware::{CLOUD_HEADER, with_problem_document};
use crate::http::problem::Problem;
use crate::http::problem::slug::Slug;
use crate::store::objects::jobs::{FoundRequest, JobResult, Lease, Outcome};
use crate::store::objects::pieces::BrokenOff;
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
    /// Its result is there, whoever wrote it, or nobody wants it any more.
    Done,
    /// The process is to end, or the store does not take the result: anybody may go on.
    Released,
}

/// An attempt at a job, which nobody else makes.
struct Attempt {
    number: u32,
    lease: Lease,
}

/// A job that is one of this process until this is dropped, also if its work panics.
struct Present<'a> {
    jobs: &'a Jobs,
    here: Arc<Here>,
}

impl Drop for Present<'_> {
    fn drop(&mut self) {
        self.jobs.remove(&self.here);
    }
}

impl Runner {
    /// Works on a job of this process when its turn has come.
    pub(super) async fn run(self, here: Arc<Here>) {
        let jobs = &self.app.jobs;
        let present = Present { jobs, here };
        let here = &*present.here;
        let name = self.app.keys.name_of(here.owner);
        let _turn = tokio::select! {
            turn = jobs.turns.take(here.owner) => turn,
            () = here.cancelled.cancelled() => return,
            () = self.app.draining.cancelled() => return,
        };
        let attempt = match self.claim(here, &name).await {
            Ok(Some(attempt)) => attempt,
            Ok(None) => return,
            Err(error) => return tracing::error!(job = %here.id, %error, "a job is put off"),
        };
        here.is_running.store(true, Ordering::Relaxed);
        let ended = tokio::select! {
            () = here.cancelled.cancelled() => Ok(Ended::Done),
            () = self.app.draining.cancelled() => Ok(Ended::Released),
            () = self.hold_lease(here, &name, &attempt) => Ok(Ended::Done),
            answered = self.answer(here, &name, &attempt) => answered.map(|()| Ended::Done),
        };
        match ended {
            Ok(Ended::Done) => {}
            Ok(Ended::Released) => self.release(here, &name, attempt).await,
            Err(error) => {
                tracing::error!(job = %here.id, %error, "a job is put off");
                self.release(here, &name, attempt).await;
            }
        }
    }

    /// Makes the next attempt that of this process, unless there is nothing to do, or another has it.
    async fn claim(&self, here: &Here, name: &OwnerName) -> Result<Option<Attempt>, Unavailable> {
        let objects = &self.app.jobs.objects;
        let found = objects.find_job(name, here.id).await?;
        let Some(job) = found.filter(|job| job.has_request && job.ended_at.is_none()) else {
            return Ok(None);
        };
        let attempt = match job.lease {
            None => Attempt { number: 0, lease: Lease::default() },
            Some((last, _)) => {
                let before = objects.get_lease(name, here.id, last).await?.unwrap_or_default();
                let n_crashes = before.n_crashes + u32::from(!before.is_released);
                Attempt { number: last + 1, lease: Lease { n_crashes, ..Lease::default() } }
            }
        };
        let is_claimed = objects.claim_job(name, here.id, attempt.number, &attempt.lease).await?;
        Ok(is_claimed.then_some(attempt))
    }

    /// Says that anybody may go on at once, as soon as the store takes that, unless the process is to end before.
    async fn release(&self, here: &Here, name: &OwnerName, attempt: Attempt) {
        let lease = Lease { is_released: true, ..attempt.lease };
        while let Err(error) = self.app.jobs.objects.renew_lease(name, here.id, attempt.number, &lease).await
        {
            tracing::warn!(job = %here.id, %error, "a job is left until its lease has expired");
            tokio::select! {
                () = tokio::time::sleep(RENEWING) => {}
                () = here.cancelled.cancelled() => return,
                () = self.app.draining.cancelled() => return,
            }
        }
    }

    /// Says again and again that the job is worked on, until that is for nothing: it has a result, another has begun it, or it is forgotten.
    async fn hold_lease(&self, here: &Here, name: &OwnerName, attempt: &Attempt) {
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
                ..attempt.lease.clone()
            };
            let renewed = match objects.find_job(name, here.id).await {
                Ok(Some(job)) if job.is_that_of(attempt.number) => {
                    objects.renew_lease(name, here.id, attempt.number, &lease).await
                }
                Ok(_) => return,
                Err(error) => Err(error),
            };
            if let Err(error) = renewed {
                // Another process may take the job up meanwhile, and one of them ends it.
                tracing::warn!(job = %here.id, %error, "the lease of a job is not written");
            }
        }
    }

    /// Answers the request, and writes what comes of it.
    async fn answer(&self, here: &Here, name: &OwnerName, attempt: &Attempt) -> Result<(), Unavailable> {
        let began = Instant::now();
        let app = &self.app;
        if attempt.lease.n_crashes >= MAX_CRASHES {
            tracing::error!(job = %here.id, "a job ended its process several times, and is given up");
            return self.write(here, name, attempt, Problem::internal().into_response()).await;
        }
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
        self.write(here, name, attempt, response).await?;
        let duration_ms = began.elapsed().as_secs_f64() * 1e3;
        tracing::info!(job = %here.id, status, duration_ms, "job {} {status}", here.id);
        Ok(())
    }

    /// The answer of the route. Nothing is held between two attempts at it: the route takes the memory that it needs, and the body is read
    /// from the store as the route reads it.
    async fn response(&self, here: &Here, name: &OwnerName) -> Result<Response, Unavailable> {
        loop {
            here.progress.restart();
            let Some(found) = self.app.jobs.objects.open_job(name, here.id).await? else {
                // It was deleted.
                return Ok(Problem::internal().into_response());
            };
            let fault = Arc::new(OnceLock::new());
            let answered = match found {
                Ok(found) => {
                    let request = rebuilt(found, here, &fault);
                    let answering = here.progress.watch(self.routes.clone().oneshot(request));
                    answering.await.unwrap_or_else(|never| match never {})
                }
                Err(damaged) => {
                    _ = fault.set(BrokenOff::Damaged);
                    tracing::error!(job = %here.id, reason = damaged.0, "a job is damaged");
                    Problem::internal().into_response()
                }
            };
            match fault.get() {
                None if answered.status() != StatusCode::SERVICE_UNAVAILABLE => return Ok(answered),
                None => {}
                Some(BrokenOff::Damaged) => {
                    self.app.jobs.objects.report_job(name, here.id);
                    return Ok(Problem::internal().into_response());
                }
                Some(BrokenOff::Store(reason)) => {
                    tracing::warn!(job = %here.id, reason, "what was asked is read again");
                }
            }
            tokio::time::sleep(AWAY).await;
        }
    }

    /// Writes what the request was answered with.
    async fn write(
        &self,
        here: &Here,
        name: &OwnerName,
        attempt: &Attempt,
        response: Response,
    ) -> Result<(), Unavailable> {
        let jobs = &self.app.jobs;
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
        let (job, outcome) = ((name, here.id), head.outcome);
        let written = jobs.objects.put_result(job, attempt.number, head, body).await;
        if has_room {
            if written? {
                self.app.metrics.job_ended(outcome);
            }
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
        if jobs.objects.put_result(job, attempt.number, head, body).await? {
            self.app.metrics.job_ended(Outcome::Failed);
        }
        Ok(())
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

/// The request as its client sent it, with its owner. Why its body broke off, if it did, is left in `fault`.
fn rebuilt(found: FoundRequest, here: &Here, fault: &Arc<OnceLock<BrokenOff>>) -> Request {
    let FoundRequest { request, n_body_bytes, body } = found;
    let fault = fault.clone();
    let body = body.inspect_err(move |error| _ = fault.set(error.clone()));
    let mut rebuilt = Request::new(Body::from_stream(body));
    rebuilt.headers_mut().insert(header::CONTENT_LENGTH, n_body_bytes.into());
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
