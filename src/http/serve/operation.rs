//! How a compute request is served, the same for every operation: read, admit, parse, plan, look at the cloud, reserve,
//! factorize or find, compute, encode. An operation only says what its plan and its answer are.

use std::sync::Arc;
use std::time::Instant;

use axum::extract::Request;
use axum::response::Response;
use serde::de::DeserializeOwned;

use super::fitted::Fits;
use super::fitting::Fitting;
use super::intake::{Intake, read_body};
use super::plan::{Cost, FitPlan, PlannedFit};
use super::planner::Planner;
use super::report::Report;
use super::sampling::find_lacking;
use crate::http::compute::{Admission, JobObserver, is_light};
use crate::http::problem::Problem;
use crate::http::serve::app::App;
use crate::http::wire::negotiation::{Format, Wanted};
use crate::http::wire::write::answer::Answer;
use crate::http::wire::write::encode::Encoded;
use crate::store::Owner;
use crate::store::budget::Reservation;

/// A request that needs a factorization.
pub trait Operation: DeserializeOwned + Send + 'static {
    /// What is left of the request once it is checked.
    type Work: Send + 'static;
    type Answer: Answer;

    /// What answers may be written as, the preferred one first; npy where there is one matrix.
    const FORMATS: &'static [Format] = &[Format::Json, Format::Safetensors];

    /// Whether it asks about a surface: that of the plan's surface, or of its main fit.
    const HAS_SURFACE: bool;

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

/// The factorizations that an operation needs, what it does with them, and what that costs.
pub struct Plan<W> {
    /// The fit of the values, or of the surface where there are no values.
    pub main: PlannedFit,
    /// The fit of the surface, if values and surface both play a part.
    pub surface: Option<PlannedFit>,
    pub work: W,
    pub cost: Cost,
}

/// A plan with nothing left out of its fits.
pub struct Resolved<W> {
    pub main: FitPlan,
    pub surface: Option<FitPlan>,
    work: W,
    pub cost: Cost,
    /// The memory of the request, for as long as it is held.
    intake: Reservation,
}

/// Serves one request.
///
/// # Errors
/// The [`Problem`] that the client is told.
pub async fn serve<O: Operation>(app: Arc<App>, owner: Owner, request: Request) -> Result<Response, Problem> {
    let (parts, body) = request.into_parts();
    let wanted = Wanted::of(&parts.headers, O::FORMATS)?;
    let intake = read_body(&app, owner, &parts.headers, body, &REQUEST_FORMATS).await?;
    let admission = app.compute.admit(owner)?;

    let began = Instant::now();
    let plan = match prepare::<O>(&app, &admission, intake, wanted, began).await? {
        Prepared::Answered(answered) => return Ok(answered.respond(&app, &admission)),
        Prepared::Ready(plan) => plan,
    };
    let mut report = Report::parsed_in(began.elapsed());

    let fitting = Fitting { app: &app, admission: &admission, has_surface: O::HAS_SURFACE };
    admission.set_flops(fitting.expected_flops(&plan.main, plan.surface.as_ref(), plan.cost));
    let (fits, memory) = fitting.fits(&plan.main, plan.surface.as_ref(), plan.cost, &mut report).await?;
    let flops = plan.cost.work.flops;
    let job = move |observer: &JobObserver| answer::<O>(*plan, &fits, memory, report, wanted, observer);
    let answered = app.compute.run(&admission, flops, job).await?.0?;
    Ok(answered.respond(&app, &admission))
}

/// An answer that only needs to be sent, with its memory.
struct Answered {
    encoded: Encoded,
    memory: Reservation,
    report: Report,
}

impl Answered {
    fn respond(self, app: &App, admission: &Admission) -> Response {
        admission.finish();
        self.report.head(self.encoded.into_response(&app.compute, self.memory))
    }
}

/// Computes and encodes, on the pool.
fn answer<O: Operation>(
    plan: Resolved<O::Work>,
    fits: &Fits,
    memory: Reservation,
    mut report: Report,
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

enum Prepared<W> {
    Ready(Box<Resolved<W>>),
    Answered(Answered),
}

/// Parses and plans, and looks at the clouds if something was left out that follows from them. What is small, and has all it
/// needs at hand, is answered at once: each job more is a thread more to wait for.
async fn prepare<O: Operation>(
    app: &Arc<App>,
    admission: &Arc<Admission>,
    intake: Intake,
    wanted: Wanted,
    began: Instant,
) -> Result<Prepared<O::Work>, Problem> {
    let (shared, admitted) = (app.clone(), admission.clone());
    let flops = intake.body.flops_to_parse();
    let parse = move |observer: &JobObserver| {
        let (request, mut memory) = intake.parse::<O>(&shared, observer)?;
        let mut plan = request.plan(&Planner { app: &shared, owner: admitted.owner })?;
        memory.shrink_to(n_bytes_held(&plan));
        if lacking_mut(&mut plan).is_some() {
            return Ok(Parsed::Lacking(Box::new(plan), memory));
        }
        let plan = resolve(plan, memory)?;
        let mut report = Report::parsed_in(began.elapsed());
        let fitting = Fitting { app: &shared, admission: &admitted, has_surface: O::HAS_SURFACE };
        let at_hand = match is_light(plan.cost.work.flops) {
            true => fitting.at_hand(&plan.main, plan.surface.as_ref(), plan.cost, &mut report),
            false => None,
        };
        Ok(match at_hand {
            None => Parsed::Done(Prepared::Ready(Box::new(plan))),
            Some((fits, memory)) => {
                let answered = answer::<O>(plan, &fits, memory, report, wanted, observer)?;
                Parsed::Done(Prepared::Answered(answered))
            }
        })
    };
    let (mut plan, memory) = match app.compute.run(admission, flops, parse).await?.0? {
        Parsed::Done(prepared) => return Ok(prepared),
        Parsed::Lacking(plan, memory) => (plan, memory),
    };
    while let Some(fit) = lacking_mut(&mut plan) {
        find_lacking(app, admission, fit).await?;
    }
    app.compute
        .run(admission, 0.0, move |_| resolve(*plan, memory))
        .await?
        .0
        .map(|plan| Prepared::Ready(Box::new(plan)))
}

enum Parsed<W> {
    Done(Prepared<W>),
    /// Its fits need to know more of their clouds.
    Lacking(Box<Plan<W>>, Reservation),
}

/// A fit that needs to know more of its cloud or of its values.
fn lacking_mut<W>(plan: &mut Plan<W>) -> Option<&mut PlannedFit> {
    let mut fits = [Some(&mut plan.main), plan.surface.as_mut()].into_iter().flatten();
    fits.find(|fit| fit.lacks_anything())
}

fn resolve<W>(plan: Plan<W>, intake: Reservation) -> Result<Resolved<W>, Problem> {
    let main = plan.main.resolve()?;
    let surface = plan.surface.map(PlannedFit::resolve).transpose()?;
    Ok(Resolved { main, surface, work: plan.work, cost: plan.cost, intake })
}

/// Bytes that a request holds until it is answered: values, queries, and clouds that may not be kept.
fn n_bytes_held<W>(plan: &Plan<W>) -> usize {
    let clouds = [Some(&plan.main), plan.surface.as_ref()].into_iter().flatten();
    let n_bytes = clouds.map(|fit| fit.stored.n_bytes() + 2 * size_of::<f64>() * fit.n_points());
    n_bytes.sum::<usize>() + plan.cost.n_held * size_of::<f64>()
}
