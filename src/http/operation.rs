//! How a compute request is served, the same for every operation: read, admit, parse, plan, factorize or find, compute,
//! encode. An operation only says what its plan and its answer are.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::Request;
use axum::http::HeaderValue;
use axum::response::Response;
use serde::de::DeserializeOwned;

use super::answer::Answer;
use super::body::read_body;
use super::compute::{JobObserver, StageTimes};
use super::encode::Encoded;
use super::fit::{FitPlan, Planner};
use super::fitted::{Fits, Fitted};
use super::limits::ParseContext;
use super::negotiation::{Format, Wanted};
use super::problem::Problem;
use crate::app::App;
use crate::numerics::error::NumericsError;
use crate::numerics::solver::GramFactor;
use crate::store::Owner;
use crate::store::factors::{CacheOutcome, StoredFactor};

/// A request that needs a factorization.
pub trait Operation: DeserializeOwned + Send + 'static {
    /// What is left of the request once it is checked.
    type Work: Send + 'static;
    type Answer: Answer;

    /// What answers may be written as, the preferred one first; npy where there is one matrix.
    const FORMATS: &'static [Format] = &[Format::Json, Format::Safetensors];

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

/// What requests that compute may be written as.
pub const REQUEST_FORMATS: [Format; 2] = [Format::Json, Format::Safetensors];

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
    let wanted = Wanted::of(&parts.headers, O::FORMATS)?;
    let body = read_body(&parts.headers, body, &REQUEST_FORMATS, app.config.max_body_bytes).await?;
    let _admission = app.compute.admit()?;

    let began = Instant::now();
    let shared = app.clone();
    let prepare = move |observer: &JobObserver| {
        let request: O = body.parse(&ParseContext::new(&shared.config, observer))?;
        request.plan(&Planner { app: &shared, owner })
    };
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
        let encoded = Encoded::of(answer, wanted)?;
        Ok::<_, Problem>((encoded, times, began.elapsed()))
    };
    let (encoded, times, encode) = app.compute.run(flops, job).await?.0?;
    report.add(times);
    report.encode = (!encoded.is_streamed()).then_some(encode);
    Ok(report.head(encoded.into_response(&app)))
}

/// Bytes of the factorizations that this request would begin.
fn n_bytes_missing<W>(app: &App, plan: &Plan<W>) -> usize {
    let surface = plan.surface.as_ref().filter(|surface| surface.key != plan.main.key);
    let fits = [Some(&plan.main), surface];
    let missing = fits.into_iter().flatten().filter(|fit| app.factors.is_missing(fit.key));
    missing.filter_map(|fit| GramFactor::n_bytes_needed(fit.fitted.n_points())).fold(0, usize::saturating_add)
}

/// What the headers say of how the answer came about.
#[derive(Default)]
struct Report {
    parse: Duration,
    stages: StageTimes,
    /// Absent if encoding goes on while the answer is sent.
    encode: Option<Duration>,
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

    fn head(&self, mut response: Response) -> Response {
        let headers = response.headers_mut();
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
            ("parse", Some(self.parse)),
            ("gram", Some(self.stages.gram)),
            ("factor", Some(self.stages.factor)),
            ("solve", Some(self.stages.solve)),
            ("evaluate", Some(self.stages.evaluate)),
            ("encode", self.encode),
        ];
        let entry = |(name, time): (&str, Option<Duration>)| {
            time.map(|time| format!("{name};dur={:.3}", time.as_secs_f64() * 1e3))
        };
        stages.into_iter().filter_map(entry).collect::<Vec<_>>().join(", ")
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
    let factor = outcome.map_err(FactorFailure::Refused)?;
    Ok(StoredFactor::new(factor, times.gram, times.factor))
}
