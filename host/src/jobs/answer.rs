//! The answer of a job, which is the answer of its route, kept as a result.

use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::Request;
use axum::http::{HeaderName, Method, StatusCode, header};
use axum::response::{IntoResponse, Response};
use futures_util::TryStreamExt;
use tower::ServiceExt;

use super::run::Attempt;
use super::{Runner, kept_headers, restore_headers};
use crate::around::middleware::with_problem_document;
use crate::around::span::RequestSpan;
use crate::memory::CacheOutcome;
use crate::problem::Problem;
use crate::problem::catalogue;
use crate::state::jobs::LocalJob;
use crate::store::jobs::{Answer, FoundRequest, JobResult, Outcome};
use crate::store::pieces::BrokenOff;
use crate::store::room::Room;
use crate::store::{OwnerName, Unavailable};

/// Most attempts that may crash their process. Without a limit, a fatal request would crash every process in
/// turn.
const MAX_CRASHES: u32 = 3;

/// Wait before a job whose route answered 503 is tried again.
const AWAY: Duration = Duration::from_secs(1);

/// Answer headers that the result of a job keeps.
static KEPT_HEADERS: [HeaderName; 4] = [
    header::CONTENT_TYPE,
    header::CONTENT_ENCODING,
    HeaderName::from_static("cache-status"),
    HeaderName::from_static("server-timing"),
];

/// A job that this process runs: an attempt at it, for an owner of this name.
#[derive(Clone, Copy)]
struct Run<'a> {
    here: &'a LocalJob,
    name: &'a OwnerName,
    attempt: &'a Attempt,
}

/// Trace id of an answer.
#[derive(Clone)]
struct Trace(String);

impl Runner {
    /// Computes the answer of a job and writes it as the result.
    pub(super) async fn answer(
        &self,
        here: &LocalJob,
        name: &OwnerName,
        attempt: &Attempt,
    ) -> Result<(), Unavailable> {
        let began = Instant::now();
        let host = &self.host;
        let run = Run { here, name, attempt };
        if attempt.lease.n_crashes >= MAX_CRASHES {
            tracing::error!(job = %here.id, "a job crashed its process several times and has failed");
            return self.write(run, Problem::internal().into_response()).await;
        }
        let within = host.settings.job_seconds;
        let answering = self.response(here, name);
        let response = match tokio::time::timeout(Duration::from_secs_f64(within), answering).await {
            Ok(response) => response?,
            Err(_) => {
                let detail = format!("no answer within {within} s; the work was cancelled");
                Problem::new(catalogue::DEADLINE_EXCEEDED, detail).into_response()
            }
        };
        let status = response.status().as_u16();
        if let Some(problem) = response.extensions().get::<Problem>() {
            host.metrics.refused(problem.slug());
        }
        if let Some(&outcome) = response.extensions().get::<CacheOutcome>() {
            host.metrics.cached(outcome);
        }
        let trace_id =
            response.extensions().get::<Trace>().map_or_else(|| "-".to_owned(), |trace| trace.0.clone());
        self.write(run, response).await?;
        let duration_ms = began.elapsed().as_secs_f64() * 1e3;
        tracing::info!(job = %here.id, trace_id, status, duration_ms, "job {} {status}", here.id);
        Ok(())
    }

    /// Returns the answer of the route. Repeats the request while the route answers 503.
    ///
    /// Nothing is held between two attempts. The route reserves the memory that it needs, and the body is
    /// read from the store as the route reads it.
    async fn response(&self, here: &LocalJob, name: &OwnerName) -> Result<Response, Unavailable> {
        loop {
            here.progress.restart();
            let Some(found) = self.host.jobs.objects.open_job(name, here.id).await? else {
                // The job was deleted.
                return Ok(Problem::internal().into_response());
            };
            let fault = Arc::new(OnceLock::new());
            let answered = match found {
                Ok(found) => {
                    let request = rebuilt(found, here, &fault);
                    let span = RequestSpan::begin_job(&here.id, request.uri().path(), request.headers());
                    let trace = Trace(span.trace_id());
                    let answering = here.progress.watch(self.routes.clone().oneshot(request));
                    let mut answered = answering.await.unwrap_or_else(|never| match never {});
                    span.end(answered.status(), answered.headers());
                    answered.extensions_mut().insert(trace);
                    answered
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
                    self.host.jobs.objects.report_job(name, here.id);
                    return Ok(Problem::internal().into_response());
                }
                Some(BrokenOff::Store(reason)) => {
                    tracing::warn!(job = %here.id, reason, "what was asked is read again");
                }
            }
            tokio::time::sleep(AWAY).await;
        }
    }

    /// Writes the answer as the result of the job.
    async fn write(&self, run: Run<'_>, response: Response) -> Result<(), Unavailable> {
        let (jobs, here) = (&self.host.jobs, run.here);
        let Some(mut room) = jobs.room(here.owner, 0) else {
            return self.write_refusal(run).await;
        };
        let written = self.write_in(&mut room, run, response).await;
        if room.is_exceeded() {
            return self.write_refusal(run).await;
        }
        if let Some(outcome) = written? {
            self.host.metrics.job_ended(outcome);
            jobs.kept.end(here.id, here.owner, room.into_reservation());
        }
        Ok(())
    }

    /// Makes a refusal the result of a job whose answer found no room. The refusal is small, and is not
    /// counted.
    async fn write_refusal(&self, run: Run<'_>) -> Result<(), Unavailable> {
        let response = self.host.jobs.too_large().into_response();
        if let Some(outcome) = self.write_in(&mut Room::unlimited(), run, response).await? {
            self.host.metrics.job_ended(outcome);
            self.host.jobs.kept.end(run.here.id, run.here.owner, None);
        }
        Ok(())
    }

    /// Writes an answer within its room. Returns the outcome if it became the result of the job.
    async fn write_in(
        &self,
        room: &mut Room,
        run: Run<'_>,
        response: Response,
    ) -> Result<Option<Outcome>, Unavailable> {
        let Run { here, name, attempt } = run;
        let response = with_problem_document(response, &here.id.to_string());
        let (head, body) = (self.head_of(&response), response.into_body().into_data_stream());
        let outcome = head.outcome;
        let answer = Answer { attempt: attempt.number, head, body };
        let is_result = self.host.jobs.objects.put_result(name, here.id, answer, room).await?;
        Ok(is_result.then_some(outcome))
    }

    fn head_of(&self, response: &Response) -> JobResult {
        let subject = self.host.guest.subject.as_ref().map(|subject| &subject.header);
        let kept = kept_headers(response.headers(), KEPT_HEADERS.iter().chain(subject));
        let outcome = if response.status().is_success() { Outcome::Succeeded } else { Outcome::Failed };
        JobResult { outcome, status: response.status().as_u16(), headers: kept.collect() }
    }
}

/// Rebuilds the request as its client sent it, with its owner. If reading the body fails, `fault` receives
/// the reason.
fn rebuilt(found: FoundRequest, here: &LocalJob, fault: &Arc<OnceLock<BrokenOff>>) -> Request {
    let FoundRequest { request, n_body_bytes, body } = found;
    let fault = fault.clone();
    let body = body.inspect_err(move |error| _ = fault.set(error.clone()));
    let mut rebuilt = Request::new(Body::from_stream(body));
    rebuilt.headers_mut().insert(header::CONTENT_LENGTH, n_body_bytes.into());
    *rebuilt.method_mut() = Method::POST;
    if let Ok(uri) = request.path.parse() {
        *rebuilt.uri_mut() = uri;
    }
    restore_headers(rebuilt.headers_mut(), &request.headers);
    rebuilt.extensions_mut().insert(here.owner);
    rebuilt
}
