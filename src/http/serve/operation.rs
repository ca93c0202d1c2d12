//! The way of a compute request, the same for every operation.
//!
//! The steps are: read, admit, parse, plan, look at the cloud, reserve memory, factorize or find, compute,
//! encode. An operation only defines its plan and its answer.

use std::sync::Arc;
use std::time::Instant;

use axum::extract::Request;
use axum::response::Response;
use serde::de::DeserializeOwned;

use super::durable::{TRUST, find_cloud, keep_all};
use super::fitted::Fits;
use super::fitting::{Fitting, Outlook};
use super::intake::{ReceivedBody, read_body};
use super::plan::{Cost, FitPlan, PlannedFit, PlannedSurface, PlannedValues};
use super::planner::{Known, LandmarkProbe, Planner, ValuesUse};
use super::report::AnswerHeaders;
use super::sampling::{find_lacking, find_landmarks};
use crate::config::Config;
use crate::http::compute::{Admission, JobObserver, Work, is_light};
use crate::http::fields::{CloudRef, DuplicatePolicy, HasCloud};
use crate::http::problem::Problem;
use crate::http::problem::slug::Slug;
use crate::http::state::app::App;
use crate::http::wire::negotiation::{BodyFormat, Format, Wanted};
use crate::http::wire::write::answer::Answer;
use crate::http::wire::write::encode::Encoded;
use crate::store::Owner;
use crate::store::budget::Reservation;
use crate::store::clouds::RegisteredCloud;
use crate::store::key::CloudId;
use gramian_numerics::error::SolverKind;
use gramian_numerics::points::duplicates::merging_flops;

/// A request with the operation that it is sent to.
pub trait Declared {
    /// Operation id in the OpenAPI document.
    const NAME: &'static str;

    type Answer: Answer;
}

/// A request that needs a model.
pub trait Operation: Declared + HasCloud + DeserializeOwned + Send + 'static {
    /// Inputs of `compute` that remain after the request is checked.
    type Work: Send + 'static;

    /// Formats of answers, the preferred one first. Answers of one matrix also have npy.
    const FORMATS: &'static [Format] = &[Format::Json, Format::Safetensors];

    /// What the request fits to values.
    fn values_use(&self) -> ValuesUse {
        ValuesUse::Nothing
    }

    /// Checks everything that can be checked without computing, the cost included.
    ///
    /// # Errors
    /// Returns the [`Problem`] for the client.
    fn plan(self, planner: &Planner<'_>) -> Result<Plan<Self::Work>, Problem>;

    /// Computes the answer on the pool, from models that are ready.
    ///
    /// # Errors
    /// Returns the [`Problem`] for the client.
    fn compute(work: Self::Work, fits: &Fits, observer: &JobObserver) -> Result<Self::Answer, Problem>;
}

/// Formats of compute requests.
pub const REQUEST_FORMATS: [BodyFormat; 2] = [BodyFormat::Json, BodyFormat::Safetensors];

/// Fits that an operation needs, the work on them, and its cost.
pub struct Plan<W> {
    /// Fit of the values, or of the surface where there are no values.
    pub main: PlannedFit,
    /// Fit of the surface, if the operation needs both values and a surface.
    pub surface: Option<PlannedFit>,
    /// Whether the work needs a surface: that of the `surface` fit, or else of the `main` fit.
    pub has_surface: bool,
    pub work: W,
    pub cost: Cost,
}

impl<W> Plan<W> {
    /// A plan for values alone.
    pub fn of_values(values: PlannedValues, work: W, cost: Cost) -> Self {
        Self { main: values.into(), surface: None, has_surface: false, work, cost }
    }

    /// A plan for the surface of a cloud.
    pub fn of_surface(surface: PlannedSurface, work: W, cost: Cost) -> Self {
        Self { main: surface.into(), surface: None, has_surface: true, work, cost }
    }

    /// A plan for values on a surface.
    pub fn on_surface(values: PlannedValues, surface: PlannedSurface, work: W, cost: Cost) -> Self {
        Self { main: values.into(), surface: Some(surface.into()), has_surface: true, work, cost }
    }
}

/// A plan whose fits are complete.
pub struct Resolved<W> {
    pub main: FitPlan,
    pub surface: Option<FitPlan>,
    has_surface: bool,
    work: W,
    pub cost: Cost,
    /// Memory of the parsed request, for as long as it is held.
    intake: Reservation,
    /// Clouds that came with the request and are only in memory.
    fresh: Vec<Arc<RegisteredCloud>>,
}

/// Serves one request.
///
/// # Errors
/// Returns the [`Problem`] for the client.
pub async fn serve<O: Operation>(app: Arc<App>, owner: Owner, request: Request) -> Result<Response, Problem> {
    let (parts, body) = request.into_parts();
    let wanted = Wanted::of(&parts.headers, O::FORMATS)?;
    let intake = read_body(&app, owner, &parts.headers, body, &REQUEST_FORMATS).await?;
    let admission = app.compute.admit(owner)?;

    let began = Instant::now();
    let parsed = |intake: ReceivedBody, app: &App, observer: &JobObserver| intake.parse::<O>(app, observer);
    let call = Call { app: app.clone(), admission: admission.clone(), wanted: Some(wanted), began };
    let plan = match prepare::<O>(&call, intake, parsed).await? {
        Prepared::Answered(answered, fresh) => {
            keep_all(&app, owner, &fresh).await;
            return Ok(answered.respond(&app, &admission));
        }
        Prepared::Ready(plan) => plan,
    };
    let fresh = plan.fresh.clone();
    let answering = compute::<O>(&call, plan, wanted);
    // The store receives new clouds while the answer is computed.
    let (answered, ()) = futures_util::future::join(answering, keep_all(&app, owner, &fresh)).await;
    Ok(answered?.respond(&app, &admission))
}

/// Factorizes or finds, then computes and encodes.
async fn compute<O: Operation>(
    call: &Call,
    plan: Box<Resolved<O::Work>>,
    wanted: Wanted,
) -> Result<Answered, Problem> {
    let (app, admission) = (&call.app, &call.admission);
    let mut report = AnswerHeaders::parsed_in(call.began.elapsed(), plan.main.stored.id);
    let fitting = Fitting { app, admission, has_surface: plan.has_surface };
    let outlook = fitting.outlook(&plan.main, plan.surface.as_ref(), plan.cost);
    within_deadline(app, admission, outlook.as_work(O::NAME))?;
    let (fits, memory) = fitting.fits(&plan.main, plan.surface.as_ref(), plan.cost, &mut report).await?;
    let flops = plan.cost.flops();
    let job = move |observer: &JobObserver| answer::<O>(*plan, &fits, memory, report, wanted, observer);
    app.compute.run(admission, flops, job).await?.0
}

/// Factor by which the estimated time may exceed the deadline. Work beyond it is refused before it begins.
///
/// Estimates are within a factor of two in the median. They are further off where nothing similar has run
/// yet.
const DOUBT: f64 = 4.0;

/// Records the work of a request. Refuses it where other requests would wait for work that is not expected to
/// end in time. An idle server tries it all the same, and learns from it if the estimate was wrong.
fn within_deadline(app: &App, admission: &Admission, work: Work) -> Result<(), Problem> {
    let Config { deadline_seconds, job_seconds, .. } = app.config;
    let deadline = if admission.is_job() { job_seconds } else { deadline_seconds };
    let seconds = admission.set_work(work);
    if seconds <= DOUBT * deadline || app.compute.is_idle_for(admission, work.flops) {
        return Ok(());
    }
    let detail = format!(
        "this would take about {seconds:.0} s, longer than the deadline of {deadline} s, and other work is under way; \
         nothing was computed"
    );
    Err(Problem::new(Slug::DeadlineExceeded, detail))
}

/// Estimated needs of a request.
pub struct Estimate {
    pub solver: SolverKind,
    pub outlook: Outlook,
    /// Seconds of work, without the wait for a turn.
    pub seconds: f64,
    /// Whether memory and time are enough for the request, if nothing else runs.
    pub is_admissible: bool,
}

/// Plans a request without answering it.
///
/// Clouds and values are examined as for the request itself, which then finds the results.
///
/// # Errors
/// Returns the refusals that the request itself would get before anything is computed.
pub async fn estimate<O: Operation>(
    app: &Arc<App>,
    admission: &Arc<Admission>,
    intake: ReceivedBody,
) -> Result<Estimate, Problem> {
    let parsed = |intake: ReceivedBody, app: &App, observer: &JobObserver| {
        let (named, memory) = intake.parse_with_operation::<O>(app, observer)?;
        Ok((named.request, memory))
    };
    let began = Instant::now();
    let call = Call { app: app.clone(), admission: admission.clone(), wanted: None, began };
    let Prepared::Ready(plan) = prepare::<O>(&call, intake, parsed).await? else {
        return Err(Problem::internal());
    };
    keep_all(app, admission.owner, &plan.fresh).await;
    let fitting = Fitting { app, admission, has_surface: plan.has_surface };
    let outlook = fitting.outlook(&plan.main, plan.surface.as_ref(), plan.cost);
    let seconds = admission.expected_seconds(outlook.as_work(O::NAME));
    let has_memory = outlook.n_bytes <= app.prepared.memory();
    Ok(Estimate {
        solver: plan.main.recipe.solver(),
        outlook,
        seconds,
        is_admissible: has_memory && seconds <= app.config.deadline_seconds,
    })
}

/// An encoded answer with its memory, ready to be sent.
struct Answered {
    encoded: Encoded,
    memory: Reservation,
    report: AnswerHeaders,
}

impl Answered {
    fn respond(self, app: &App, admission: &Admission) -> Response {
        admission.finish();
        self.report.head(self.encoded.into_response(&app.compute, self.memory))
    }
}

/// Computes and encodes on the pool.
fn answer<O: Operation>(
    plan: Resolved<O::Work>,
    fits: &Fits,
    memory: Reservation,
    mut report: AnswerHeaders,
    wanted: Wanted,
    observer: &JobObserver,
) -> Result<Answered, Problem> {
    let Resolved { work, intake, .. } = plan;
    let answer = O::compute(work, fits, observer)?;
    drop(intake);
    let times = observer.times();
    let began = Instant::now();
    let encoded = Encoded::of(answer, wanted)?;
    report.computed(times, (!encoded.is_streamed()).then_some(began.elapsed()));
    Ok(Answered { encoded, memory, report })
}

/// A call of an operation: who makes it, the format of its answer, and the time at which parsing began.
#[derive(Clone)]
struct Call {
    app: Arc<App>,
    admission: Arc<Admission>,
    /// `None` for estimates, which are not answered by the operation.
    wanted: Option<Wanted>,
    began: Instant,
}

enum Prepared<W> {
    Ready(Box<Resolved<W>>),
    Answered(Box<Answered>, Vec<Arc<RegisteredCloud>>),
}

/// Parses and plans, and examines clouds and values where the fits depend on them.
///
/// Small requests whose models are ready are answered in the same job, because each further job waits for a
/// thread.
async fn prepare<O: Operation>(
    call: &Call,
    intake: ReceivedBody,
    parsed: impl FnOnce(ReceivedBody, &App, &JobObserver) -> Result<(O, Reservation), Problem> + Send + 'static,
) -> Result<Prepared<O::Work>, Problem> {
    let (app, admission) = (&call.app, &call.admission);
    let flops = intake.body.flops_to_parse();
    let shared = call.clone();
    let parse = move |observer: &JobObserver| {
        let (request, memory) = parsed(intake, &shared.app, observer)?;
        let received = Received { request, memory, known: Known::default() };
        let absent = ids_not_in_memory(&shared.app, shared.admission.owner, &received.request);
        if !absent.is_empty() || !is_light(planning_flops(&shared, &received)) {
            return Ok(Parsed::Unplanned(Box::new(received), absent));
        }
        planned(&shared, received, observer)
    };
    let mut parsed = app.compute.run(admission, flops, parse).await?.0?;
    let planned = loop {
        let received = match parsed {
            Parsed::Planned(planned) => break planned,
            Parsed::Unplanned(mut received, ids) => {
                for id in ids {
                    received.known.clouds.extend(find_cloud(app, admission.owner, id).await?);
                }
                received
            }
            Parsed::NotProbed(mut received, probe) => {
                received.known.landmarks = Some(find_landmarks(app, admission, *probe).await?);
                received
            }
        };
        let (shared, flops) = (call.clone(), planning_flops(call, &received));
        let plan = move |observer: &JobObserver| planned(&shared, *received, observer);
        parsed = app.compute.run(admission, flops, plan).await?.0?;
    };
    let (mut plan, memory, fresh) = match planned {
        Planned::Done(prepared) => return Ok(prepared),
        Planned::Lacking(plan, memory, fresh) => (plan, memory, fresh),
    };
    while let Some(fit) = lacking_mut(&mut plan) {
        find_lacking(app, admission, fit).await?;
    }
    let flops = resolving_flops(&plan);
    let job = move |observer: &JobObserver| resolve(*plan, Held { memory, fresh }, observer);
    app.compute.run(admission, flops, job).await?.0.map(|plan| Prepared::Ready(Box::new(plan)))
}

/// Plans a parsed request.
fn planned<O: Operation>(
    call: &Call,
    received: Received<O>,
    observer: &JobObserver,
) -> Result<Parsed<O>, Problem> {
    let Call { app, admission, wanted, began } = call;
    let Received { mut request, mut memory, known } = received;
    let mut planner = Planner::knowing(app, admission.owner, known);
    let values_use = request.values_use();
    if let Some(probe) = planner.landmark_probe(&mut request, values_use)? {
        let received = Received { request, memory, known: planner.into_known() };
        return Ok(Parsed::NotProbed(Box::new(received), Box::new(probe)));
    }
    let mut plan = request.plan(&planner)?;
    let fresh = planner.into_known().fresh.into_inner();
    memory.shrink_to(n_bytes_held(&plan));
    if lacking_mut(&mut plan).is_some() {
        return Ok(Parsed::Planned(Planned::Lacking(Box::new(plan), memory, fresh)));
    }
    let plan = resolve(plan, Held { memory, fresh }, observer)?;
    let mut report = AnswerHeaders::parsed_in(began.elapsed(), plan.main.stored.id);
    let fitting = Fitting { app, admission, has_surface: plan.has_surface };
    let wanted = wanted.filter(|_| is_light(plan.cost.flops()));
    let at_hand = wanted.and_then(|wanted| {
        let found = fitting.at_hand(&plan.main, plan.surface.as_ref(), plan.cost, &mut report)?;
        Some((found, wanted))
    });
    Ok(Parsed::Planned(match at_hand {
        None => Planned::Done(Prepared::Ready(Box::new(plan))),
        Some(((fits, memory), wanted)) => {
            let fresh = plan.fresh.clone();
            let work = Work { operation: O::NAME, is_cached: true, flops: plan.cost.flops() };
            let before = observer.times();
            let answered = answer::<O>(plan, &fits, memory, report, wanted, observer)?;
            let after = observer.times();
            if !after.ended_early {
                admission.did_at_once(work, after.whole - before.whole);
            }
            Planned::Done(Prepared::Answered(Box::new(answered), fresh))
        }
    }))
}

/// Finds the clouds that a request names and memory does not have, if there is a store to look in.
fn ids_not_in_memory<O: Operation>(app: &App, owner: Owner, request: &O) -> Vec<CloudId> {
    if app.durable.is_none() {
        return Vec::new();
    }
    let named = [Some(request.cloud()), request.surface_cloud()].into_iter().flatten();
    let ids = named.filter_map(|cloud| CloudId::parse(cloud.id.as_deref()?));
    let is_at_hand = |id| app.clouds.get(owner, id).is_some_and(|cloud| cloud.is_trusted(TRUST));
    ids.filter(|&id| !is_at_hand(id)).collect()
}

/// Flops of planning a request, beside parsing it: of merging points that coincide.
fn planning_flops<O: Operation>(call: &Call, received: &Received<O>) -> f64 {
    if !received.request.may_merge() {
        return 0.0;
    }
    let n_points = |cloud: &CloudRef| {
        let id = cloud.id.as_deref().and_then(CloudId::parse);
        let of_id = |id| {
            let found = received.known.clouds.iter().find(|cloud| cloud.id == id).cloned();
            found.or_else(|| call.app.clouds.get(call.admission.owner, id))
        };
        let registered = cloud.registered.clone().or_else(|| id.and_then(of_id));
        let of_points = || cloud.points.as_ref().map(|points| points.n_rows);
        registered.map(|cloud| cloud.cloud.n_points()).or_else(of_points).unwrap_or_default()
    };
    let of_surface = received.request.surface_cloud().map_or(0, n_points);
    merging_flops(n_points(received.request.cloud())) + merging_flops(of_surface)
}

/// Flops of completing a plan: of merging points that coincide.
fn resolving_flops<W>(plan: &Plan<W>) -> f64 {
    let fits = [Some(&plan.main), plan.surface.as_ref()].into_iter().flatten();
    let merged = fits.map(PlannedFit::on).filter(|on| on.duplicates == DuplicatePolicy::Merge);
    merged.map(|on| merging_flops(on.n_points())).sum()
}

/// A parsed request with its memory, and what is known of its clouds.
struct Received<O> {
    request: O,
    memory: Reservation,
    known: Known,
}

/// A request whose body was parsed.
enum Parsed<O: Operation> {
    Planned(Planned<O::Work>),
    /// Some clouds of the request have to be read from the store before it can be planned, or planning is
    /// no light work.
    Unplanned(Box<Received<O>>, Vec<CloudId>),
    /// `auto` chooses a solver by a number of landmarks that is not known yet.
    NotProbed(Box<Received<O>>, Box<LandmarkProbe>),
}

/// A request that was checked.
enum Planned<W> {
    Done(Prepared<W>),
    /// The fits need to know more of their clouds or values.
    Lacking(Box<Plan<W>>, Reservation, Vec<Arc<RegisteredCloud>>),
}

/// Returns a fit that needs to know more of its cloud or its values.
fn lacking_mut<W>(plan: &mut Plan<W>) -> Option<&mut PlannedFit> {
    let mut fits = [Some(&mut plan.main), plan.surface.as_mut()].into_iter().flatten();
    fits.find(|fit| fit.lack().is_some())
}

/// What a request holds while it is planned: its memory, and its clouds that are only in memory.
struct Held {
    memory: Reservation,
    fresh: Vec<Arc<RegisteredCloud>>,
}

fn resolve<W>(plan: Plan<W>, held: Held, observer: &JobObserver) -> Result<Resolved<W>, Problem> {
    let main = plan.main.resolve(observer)?;
    let surface = plan.surface.map(|surface| surface.resolve(observer)).transpose()?;
    let Plan { has_surface, work, cost, .. } = plan;
    let Held { memory, fresh } = held;
    Ok(Resolved { main, surface, has_surface, work, cost, intake: memory, fresh })
}

/// Bytes that a request holds until it is answered: values, queries, and clouds that the cache may drop.
fn n_bytes_held<W>(plan: &Plan<W>) -> usize {
    let clouds = [Some(&plan.main), plan.surface.as_ref()].into_iter().flatten();
    let n_bytes = clouds.map(|fit| {
        let on = fit.on();
        on.stored.n_bytes() + 2 * size_of::<f64>() * on.n_points()
    });
    n_bytes.sum::<usize>() + plan.cost.n_held * size_of::<f64>()
}
