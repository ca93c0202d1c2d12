//! How a compute request is served, the same for every operation: read, admit, parse, plan, factorize or find, compute,
//! encode. An operation only says what its plan and its answer are.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::Request;
use axum::http::{HeaderValue, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::body::{parse_json, read_json_body};
use super::compute::{JobObserver, StageTimes};
use super::fit::{FitPlan, Planner};
use super::fitted::{Fits, Fitted};
use super::problem::Problem;
use super::slug::Slug;
use crate::app::App;
use crate::numerics::error::NumericsError;
use crate::numerics::solver::GramFactor;
use crate::store::Owner;
use crate::store::factors::{CacheOutcome, StoredFactor};

/// A request that needs a factorization.
pub trait Operation: DeserializeOwned + Send + 'static {
    /// What is left of the request once it is checked.
    type Work: Send + 'static;
    type Answer: Serialize;

    /// Checks everything that can be checked without computing, the cost included.
    ///
    /// # Errors
    /// The [`Problem`] that the client is told.
    fn plan(self, planner: &Planner<'_>) -> Result<Plan<Self::Work>, Problem>;

    /// Computes the answer on the pool, with the factorizations at hand.
    ///
    /// # Errors
    /// The [`Problem`] that the client is told.
    fn compute(work: Self::Work, fits: &Fits, observer: &JobObserver) -> Result<Self::Answer, Problem>;
}

/// The factorizations that an operation needs, what it does with them, and the flops of that.
pub struct Plan<W> {
    /// The fit of the values, or of the surface where there are no values.
    pub main: FitPlan,
    /// The fit of the surface, if values and surface both play a part.
    pub surface: Option<FitPlan>,
    pub work: W,
    pub flops: f64,
}

/// Serves one request.
///
/// # Errors
/// The [`Problem`] that the client is told.
pub async fn serve<O: Operation>(app: Arc<App>, owner: Owner, request: Request) -> Result<Response, Problem> {
    let (parts, body) = request.into_parts();
    let bytes = read_json_body(&parts.headers, body, app.config.max_body_bytes).await?;
    let _admission = app.compute.admit()?;

    let began = Instant::now();
    let shared = app.clone();
    let prepare = move |_: &JobObserver| parse_json::<O>(&bytes)?.plan(&Planner { app: &shared, owner });
    let plan = app.compute.run(0.0, prepare).await?.0?;
    let mut report = Report { parse: began.elapsed(), ..Report::default() };

    let _memory = app.compute.reserve(n_bytes_missing(&app, &plan)).await?;
    let main = report.fitted(&app, plan.main).await?;
    let surface = match plan.surface {
        Some(surface) if surface.key != main.plan.key => Some(report.fitted(&app, surface).await?),
        Some(_) | None => None,
    };
    let fits = Fits { app: app.clone(), main, surface };
    let (work, flops) = (plan.work, plan.flops);
    let job = move |observer: &JobObserver| {
        let answer = O::compute(work, &fits, observer)?;
        let times = observer.times();
        let began = Instant::now();
        let body = serde_json::to_vec(&answer).map_err(|_| beyond_float64())?;
        Ok::<_, Problem>((body, times, began.elapsed()))
    };
    let (body, times, encode) = app.compute.run(flops, job).await?.0?;
    report.add(times);
    report.encode = encode;
    Ok(report.respond(body))
}

/// Bytes of the factorizations that this request would begin.
fn n_bytes_missing<W>(app: &App, plan: &Plan<W>) -> usize {
    let surface = plan.surface.as_ref().filter(|surface| surface.key != plan.main.key);
    let fits = [Some(&plan.main), surface];
    let missing = fits.into_iter().flatten().filter(|fit| app.factors.is_missing(fit.key));
    missing.filter_map(|fit| GramFactor::n_bytes_needed(fit.fitted.n_points())).fold(0, usize::saturating_add)
}

/// The encoder's only objection is a number that JSON does not have.
fn beyond_float64() -> Problem {
    let detail =
        "the answer is outside the range of float64; scale the points, the values or the length scale";
    Problem::new(Slug::InvalidRequest, detail)
}

/// What the headers say of how the answer came about.
#[derive(Default)]
struct Report {
    parse: Duration,
    stages: StageTimes,
    encode: Duration,
    cache: Option<CacheOutcome>,
}

impl Report {
    async fn fitted(&mut self, app: &Arc<App>, plan: FitPlan) -> Result<Fitted, Problem> {
        let factorization = || factorize(app.clone(), plan.clone());
        let found = app.factors.get_or_factorize(plan.key, factorization).await;
        let (stored, outcome) = found.map_err(|failure| match failure {
            FactorFailure::Refused(error) => plan.refused(error),
            FactorFailure::Broken(problem) => problem,
        })?;
        // With two factors the answer is a hit only if both are: the outcomes are ordered by cost.
        self.cache = self.cache.max(Some(outcome));
        if outcome != CacheOutcome::Hit {
            self.stages.gram += stored.gram_time;
            self.stages.factor += stored.factor_time;
        }
        Ok(Fitted { plan, stored })
    }

    fn add(&mut self, times: StageTimes) {
        self.stages.solve += times.solve;
        self.stages.evaluate += times.evaluate;
    }

    fn respond(&self, body: Vec<u8>) -> Response {
        let mut response = body.into_response();
        let headers = response.headers_mut();
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/json"));
        let cache = match self.cache {
            None | Some(CacheOutcome::Hit) => "gramian; hit",
            Some(CacheOutcome::Collapsed) => "gramian; fwd=miss; collapsed",
            Some(CacheOutcome::Stored) => "gramian; fwd=miss; stored",
            Some(CacheOutcome::NotStored) => "gramian; fwd=miss",
        };
        headers.insert("cache-status", HeaderValue::from_static(cache));
        if let Ok(timing) = HeaderValue::from_str(&self.server_timing()) {
            headers.insert("server-timing", timing);
        }
        response
    }

    fn server_timing(&self) -> String {
        let stages = [
            ("parse", self.parse),
            ("gram", self.stages.gram),
            ("factor", self.stages.factor),
            ("solve", self.stages.solve),
            ("evaluate", self.stages.evaluate),
            ("encode", self.encode),
        ];
        let entry = |(name, time): (&str, Duration)| format!("{name};dur={:.3}", time.as_secs_f64() * 1e3);
        stages.map(entry).join(", ")
    }
}

/// Why there is no factorization. Requests that share a computation share its failure, but each has pointers of its own.
#[derive(Debug, Clone)]
pub enum FactorFailure {
    Refused(NumericsError),
    Broken(Problem),
}

async fn factorize(app: Arc<App>, plan: FitPlan) -> Result<StoredFactor, FactorFailure> {
    let flops = GramFactor::flops_needed(plan.fitted.n_points());
    let spare = app.factors.spare().clone();
    let job = move |observer: &JobObserver| {
        GramFactor::factorize_with(&spare, plan.fitted, plan.kernel, plan.regularization, observer)
    };
    let (outcome, times) = app.compute.run(flops, job).await.map_err(FactorFailure::Broken)?;
    let stored = StoredFactor::new(outcome.map_err(FactorFailure::Refused)?, times.gram, times.factor);
    let factor = stored.factor.clone();
    // Nobody waits for it, and the work is the operating system's.
    tokio::task::spawn_blocking(move || factor.prepare_another(app.factors.spare()));
    Ok(stored)
}
