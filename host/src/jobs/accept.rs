//! Acceptance of requests as jobs.

use std::sync::Arc;

use axum::extract::{MatchedPath, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use bytes::Bytes;

use super::idempotency::{KeyState, fingerprint, key_of, known};
use super::look::{JobView, view_of_here};
use super::{Runner, kept_headers};
use crate::around::trace::TraceParent;
use crate::memory::Owner;
use crate::operation::intake::read_bytes;
use crate::problem::Problem;
use crate::state::jobs::LocalJob;
use crate::state::kept::SECONDS_UNTIL_COUNTED;
use crate::store::changes::{to_its_end, unavailable};
use crate::store::jobs::{Claim, JobId, JobRequest, KeyHash, NewJob, Register};
use crate::wire::write::json::Json;

const PREFER: HeaderName = HeaderName::from_static("prefer");
const PREFERENCE_APPLIED: HeaderName = HeaderName::from_static("preference-applied");

/// Request headers that a job keeps. None of them is secret.
///
/// They belong to the fingerprint of the request. The header with its subject is kept as well, but only
/// repeats the subject for proxies.
static KEPT_HEADERS: [HeaderName; 4] =
    [header::ACCEPT, header::ACCEPT_ENCODING, header::CONTENT_TYPE, header::CONTENT_ENCODING];

/// Header with the trace that the work on the job belongs to.
const TRACE: &str = "traceparent";

/// Answers 202 to a POST that prefers so, and computes its answer in the background. A layer of the routes
/// whose work may take longer than receiving the body.
pub async fn respond_async(State(runner): State<Runner>, request: Request, next: Next) -> Response {
    let may_be_long = request.method() == Method::POST;
    // A request without a route is refused at once.
    let has_route = request.extensions().get::<MatchedPath>().is_some();
    if !may_be_long || !has_route || !prefers_async(request.headers()) {
        return next.run(request).await;
    }
    match accept(runner, request).await {
        Ok(response) => response,
        Err(problem) => problem.into_response(),
    }
}

/// Whether `Prefer` contains `respond-async`. Preferences are separated by commas, may have parameters, and
/// their names are case-insensitive (RFC 7240, section 2).
fn prefers_async(headers: &HeaderMap) -> bool {
    let lines = headers.get_all(PREFER).iter().filter_map(|line| line.to_str().ok());
    let mut preferences = lines.flat_map(|line| line.split(','));
    preferences.any(|preference| {
        preference.split(';').next().is_some_and(|name| name.trim().eq_ignore_ascii_case("respond-async"))
    })
}

pub(super) async fn accept(runner: Runner, request: Request) -> Result<Response, Problem> {
    let host = runner.host.clone();
    let (parts, body) = request.into_parts();
    let owner = parts.extensions.get::<Owner>().copied().ok_or_else(Problem::internal)?;
    let key = key_of(&parts.headers)?;
    let (bytes, memory) = read_bytes(&host, owner, &parts.headers, body).await?;
    let path = parts.uri.path().to_owned();
    let subject = host.guest.subject.as_ref().map(|subject| &subject.header);
    let kept = kept_headers(&parts.headers, KEPT_HEADERS.iter().chain(subject));
    let trace = parts.extensions.get::<TraceParent>().map(|parent| (TRACE.to_owned(), parent.to_string()));
    let request = JobRequest { path, headers: kept.chain(trace).collect() };
    let asked = JobSubmission { owner, request, body: bytes.into() };
    let Some(key) = key else {
        let entered = asked.write(&runner).await?;
        return Ok(accepted(&entered.begin()?));
    };
    // A client that leaves between the writes of a job and of its claim would leave a job that nobody knows.
    let accepting = async move {
        let _memory = memory;
        asked.with_key(&runner, &key).await
    };
    to_its_end(accepting).await.map(|view| accepted(&view))
}

/// Attempts to find or claim the job of a key.
const ATTEMPTS: usize = 8;

/// 202 with the location of the job.
fn accepted(view: &JobView) -> Response {
    let location = [(header::LOCATION, format!("/v1/jobs/{}", view.id()))];
    let mut response = (StatusCode::ACCEPTED, location, Json(view)).into_response();
    response.headers_mut().insert(PREFERENCE_APPLIED, HeaderValue::from_static("respond-async"));
    response
}

/// A request that is to become a job.
struct JobSubmission {
    owner: Owner,
    request: JobRequest,
    body: Bytes,
}

impl JobSubmission {
    /// Returns the job of a key: the one that claims it already, or a new one.
    async fn with_key(&self, runner: &Runner, key: &KeyHash) -> Result<JobView, Problem> {
        let mut written = None;
        match (self.claim(runner, key, &mut written).await, written) {
            (Ok(None), Some(entered)) => entered.begin(),
            (outcome, written) => {
                if let Some(entered) = written {
                    entered.withdraw().await;
                }
                outcome?.ok_or_else(Problem::internal)
            }
        }
    }

    /// Finds the job of a key, or writes a job and claims the key for it. Returns `None` if the job that was
    /// written has the claim.
    async fn claim<'a>(
        &self,
        runner: &'a Runner,
        key: &KeyHash,
        written: &mut Option<RegistrationGuard<'a>>,
    ) -> Result<Option<JobView>, Problem> {
        let fingerprint = fingerprint(&self.request, &KEPT_HEADERS, &self.body).await;
        for _ in 0..ATTEMPTS {
            let register = match known(&runner.host, self.owner, key, &fingerprint).await? {
                KeyState::Job(view) => return Ok(Some(*view)),
                KeyState::Free(register) => register,
            };
            let entered = match written.take() {
                Some(entered) => entered,
                None => self.write(runner).await?,
            };
            if written.insert(entered).claim(register, key, &fingerprint).await? {
                return Ok(None);
            }
        }
        Err(Problem::unavailable("jobs with Idempotency-Keys are created too quickly", SECONDS_UNTIL_COUNTED))
    }

    /// Writes the job. It waits until [`RegistrationGuard::begin`].
    async fn write<'a>(&self, runner: &'a Runner) -> Result<RegistrationGuard<'a>, Problem> {
        let (host, owner, id) = (&runner.host, self.owner, JobId::new());
        let Some(local) = host.jobs.add(id, owner, None) else { return Err(host.compute.out_of_memory()) };
        // On failure the guard takes the job out of this process.
        let entered = RegistrationGuard { runner, local: Some(local) };
        host.jobs.kept.add(id, owner)?;
        let Some(mut room) = host.jobs.room(owner, self.body.len()) else {
            let reason = "the stored jobs leave no room for this request";
            return Err(host.jobs.kept.refused(owner, reason));
        };
        let name = host.keys.name_of(owner);
        let job = NewJob { id, request: &self.request, body: self.body.clone() };
        let written = host.jobs.objects.put_job(&name, job, &mut room);
        written.await.map_err(|error| unavailable(&error))?;
        host.jobs.kept.pay(id, room.into_reservation());
        Ok(entered)
    }
}

/// A guard that takes a job out of this process, unless it is begun.
struct RegistrationGuard<'a> {
    runner: &'a Runner,
    local: Option<Arc<LocalJob>>,
}

impl RegistrationGuard<'_> {
    /// Claims a key for the job. Returns false if the register was changed meanwhile.
    async fn claim(&self, register: Register, key: &KeyHash, fingerprint: &str) -> Result<bool, Problem> {
        let Some(local) = &self.local else { return Err(Problem::internal()) };
        let host = &self.runner.host;
        let claim = Claim::new(key.clone(), local.id, fingerprint.to_owned());
        let claimed = host.jobs.objects.claim_key(&host.keys.name_of(local.owner), register, claim).await;
        claimed.map_err(|error| unavailable(&error))
    }

    /// Begins the job.
    fn begin(mut self) -> Result<JobView, Problem> {
        let Some(local) = self.local.take() else { return Err(Problem::internal()) };
        let view = view_of_here(&local);
        tokio::spawn(self.runner.clone().run(local));
        Ok(view)
    }

    /// Deletes the job. One that the store keeps all the same is begun by a later round, without a claim.
    async fn withdraw(self) {
        let Some(local) = &self.local else { return };
        let host = &self.runner.host;
        if let Err(error) = host.jobs.forget(&host.keys.name_of(local.owner), local.id).await {
            tracing::warn!(job = %local.id, %error, "a job without a claim could not be deleted");
        }
    }
}

impl Drop for RegistrationGuard<'_> {
    fn drop(&mut self) {
        if let Some(local) = self.local.take() {
            self.runner.host.jobs.kept.remove(local.id);
            self.runner.host.jobs.remove(&local);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_preference_is_found_among_others() {
        let prefers = |lines: &[&str]| {
            let mut headers = HeaderMap::new();
            for line in lines {
                headers.append(PREFER, HeaderValue::from_str(line).unwrap());
            }
            prefers_async(&headers)
        };
        assert!(prefers(&["respond-async"]) && prefers(&["return=minimal, Respond-Async; a=b", "wait=1"]));
        assert!(prefers(&["wait=1", "respond-async"]) && prefers(&[",respond-async"]));
        assert!(!prefers(&[]) && !prefers(&["respond-asynchronously"]) && !prefers(&["a=respond-async"]));
    }
}
