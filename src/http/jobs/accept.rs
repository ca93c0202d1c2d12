//! Acceptance of requests as jobs.

use std::sync::Arc;

use axum::extract::{MatchedPath, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use bytes::Bytes;

use super::idempotency::{Known, fingerprint, key_of, known};
use super::look::{JobView, view_of_here};
use super::{Runner, kept_headers};
use crate::http::around::middleware::CLOUD_HEADER;
use crate::http::around::trace::TraceParent;
use crate::http::problem::Problem;
use crate::http::serve::durable::unavailable;
use crate::http::serve::intake::read_bytes;
use crate::http::state::jobs::LocalJob;
use crate::http::state::kept::SECONDS_UNTIL_COUNTED;
use crate::http::wire::write::json::Json;
use crate::store::Owner;
use crate::store::objects::jobs::{Claim, ClaimName, JobId, JobRequest, NewJob};

const PREFER: HeaderName = HeaderName::from_static("prefer");
const PREFERENCE_APPLIED: HeaderName = HeaderName::from_static("preference-applied");

/// Request headers that a job keeps. None of them is secret.
static KEPT_HEADERS: [HeaderName; 5] =
    [header::ACCEPT, header::ACCEPT_ENCODING, header::CONTENT_TYPE, header::CONTENT_ENCODING, CLOUD_HEADER];

/// Headers that belong to the fingerprint of a request. The cloud is not one of them: the header only repeats
/// it for proxies.
static MEANT_HEADERS: [HeaderName; 4] =
    [header::ACCEPT, header::ACCEPT_ENCODING, header::CONTENT_TYPE, header::CONTENT_ENCODING];

/// Header with the trace that the work on the job belongs to.
const TRACE: &str = "traceparent";

/// Routes that ignore the preference, because their work takes no longer than receiving the body.
const AT_ONCE: [&str; 4] = ["/v1/clouds", "/v1/estimate", "/v1/coarse", "/v1/sides"];

/// Answers 202 to a POST that prefers so, and computes its answer in the background.
pub async fn respond_async(State(runner): State<Runner>, request: Request, next: Next) -> Response {
    let may_be_long = request.method() == Method::POST && !AT_ONCE.contains(&request.uri().path());
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

async fn accept(runner: Runner, request: Request) -> Result<Response, Problem> {
    let app = runner.app.clone();
    let (parts, body) = request.into_parts();
    let owner = parts.extensions.get::<Owner>().copied().ok_or_else(Problem::internal)?;
    let key = key_of(&parts.headers)?;
    let (bytes, _memory) = read_bytes(&app, owner, &parts.headers, body).await?;
    let path = parts.uri.path().to_owned();
    let kept = kept_headers(&parts.headers, &KEPT_HEADERS);
    let trace = parts.extensions.get::<TraceParent>().map(|parent| (TRACE.to_owned(), parent.to_string()));
    let request = JobRequest { path, headers: kept.chain(trace).collect() };
    let asked = Asked { owner, request, body: bytes.into() };
    let Some(key) = key else {
        let entered = asked.write(&runner).await?;
        return Ok(accepted(&entered.begin()?));
    };
    let fingerprint = fingerprint(&asked.request, &MEANT_HEADERS, &asked.body).await;
    // One of several equal requests claims the key. The others find its job in the next turn, unless it was
    // deleted meanwhile.
    for _ in 0..ATTEMPTS {
        let claim = match known(&app, owner, &key, &fingerprint).await? {
            Known::Job(view) => return Ok(accepted(&view)),
            Known::Free(claim) => claim,
        };
        let entered = asked.write(&runner).await?;
        match entered.claim(&claim, &fingerprint).await {
            Ok(true) => return Ok(accepted(&entered.begin()?)),
            Ok(false) => entered.withdraw().await?,
            Err(problem) => {
                entered.withdraw().await.ok();
                return Err(problem);
            }
        }
    }
    Err(Problem::unavailable(
        "jobs with this Idempotency-Key are created and deleted too quickly",
        SECONDS_UNTIL_COUNTED,
    ))
}

/// Attempts to find or claim the job of a key.
const ATTEMPTS: usize = 4;

/// 202 with the location of the job.
fn accepted(view: &JobView) -> Response {
    let location = [(header::LOCATION, format!("/v1/jobs/{}", view.id()))];
    let mut response = (StatusCode::ACCEPTED, location, Json(view)).into_response();
    response.headers_mut().insert(PREFERENCE_APPLIED, HeaderValue::from_static("respond-async"));
    response
}

/// A request that is to become a job.
struct Asked {
    owner: Owner,
    request: JobRequest,
    body: Bytes,
}

impl Asked {
    /// Writes the job. It waits until [`Entered::begin`].
    async fn write<'a>(&self, runner: &'a Runner) -> Result<Entered<'a>, Problem> {
        let (app, owner, id) = (&runner.app, self.owner, JobId::new());
        let Some(here) = app.jobs.add(id, owner, None) else { return Err(app.compute.out_of_memory()) };
        // On failure the guard takes the job out of this process.
        let entered = Entered { runner, here: Some(here) };
        app.jobs.kept.add(id, owner)?;
        let Some(mut room) = app.jobs.room(owner, self.body.len()) else {
            let reason = "the stored jobs leave no room for this request";
            return Err(app.jobs.kept.refused(owner, reason));
        };
        let name = app.keys.name_of(owner);
        let job = NewJob { id, request: &self.request, body: self.body.clone() };
        let written = app.jobs.objects.put_job(&name, job, &mut room);
        written.await.map_err(|error| unavailable(&error))?;
        app.jobs.kept.pay(id, room.into_reservation());
        Ok(entered)
    }
}

/// A guard that takes a job out of this process, unless it is begun.
struct Entered<'a> {
    runner: &'a Runner,
    here: Option<Arc<LocalJob>>,
}

impl Entered<'_> {
    /// Claims a key for the job. Returns false if another job has it.
    async fn claim(&self, claim: &ClaimName, fingerprint: &str) -> Result<bool, Problem> {
        let Some(here) = &self.here else { return Err(Problem::internal()) };
        let app = &self.runner.app;
        let meant = Claim::new(here.id, fingerprint.to_owned());
        let claimed = app.jobs.objects.claim_key(&app.keys.name_of(here.owner), claim, &meant).await;
        claimed.map_err(|error| unavailable(&error))
    }

    /// Begins the job.
    fn begin(mut self) -> Result<JobView, Problem> {
        let Some(here) = self.here.take() else { return Err(Problem::internal()) };
        let view = view_of_here(&here);
        tokio::spawn(self.runner.clone().run(here));
        Ok(view)
    }

    /// Deletes the job.
    async fn withdraw(self) -> Result<(), Problem> {
        let Some(here) = &self.here else { return Ok(()) };
        let app = &self.runner.app;
        let forgotten = app.jobs.forget(&app.keys.name_of(here.owner), here.id).await;
        forgotten.map(|_| ()).map_err(|error| unavailable(&error))
    }
}

impl Drop for Entered<'_> {
    fn drop(&mut self) {
        if let Some(here) = self.here.take() {
            self.runner.app.jobs.kept.remove(here.id);
            self.runner.app.jobs.remove(&here);
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
