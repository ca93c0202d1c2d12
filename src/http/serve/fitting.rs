//! Models and surfaces for plans: found in the cache, or made once for all who ask, in reserved memory.

use std::sync::{Arc, OnceLock};

use super::durable::factors;
use super::fitted::{FitModel, Fits};
use super::plan::{Cost, FitPlan, FitPlans};
use super::sampling::find_sampling;
use crate::http::problem::Problem;
use crate::http::state::app::{App, FitFailure};
use crate::store::key::ValuesKey;
use crate::store::prepared::{Missing, PreparedFit};
use gramian_host::compute::{Admission, JobObserver, StageTimes};
use gramian_host::memory::CacheOutcome;
use gramian_host::memory::budget::Reservation;
use gramian_host::operation::{AnswerHeaders, Outlook};
use gramian_numerics::model::price::MakingPrice;
use gramian_numerics::model::{Making, Model, SurfaceMaking};
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::regression::solver::Workspace;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::local::LocalInputs;

/// Bytes that a request takes whatever its size: small vectors, headers, and the text of its diagnostics.
const LEAST_BYTES: usize = 16 << 10;

/// Preparation of the models of one request: found in the cache, or made.
pub struct Fitting<'a> {
    pub app: &'a Arc<App>,
    pub admission: &'a Arc<Admission>,
    pub plans: &'a FitPlans,
}

/// Memory of a request, reserved all at once. Waiting for a part while holding another could deadlock.
struct Memory {
    work: Reservation,
    main: Option<Reservation>,
    other: Option<Reservation>,
    surface: Option<Reservation>,
}

impl Fitting<'_> {
    /// Returns the fits with their models, and the memory for the work with them.
    ///
    /// # Errors
    /// 413 if the request takes more memory than there is, and the refusals of the factorization.
    pub async fn fits(&self, headers: &mut AnswerHeaders) -> Result<(Fits, Reservation), Problem> {
        let mut extents = Extents { main: Extent::Expected, other: Extent::Expected };
        loop {
            if let Some(found) = self.attempt(&mut extents, headers).await? {
                return Ok(found);
            }
            // Other tasks get their turn, however often this repeats.
            tokio::task::yield_now().await;
        }
    }

    /// Returns the fits without waiting, if nothing is missing and memory for the work is free.
    pub fn at_hand(&self, headers: &mut AnswerHeaders) -> Option<(Fits, Reservation)> {
        let find = |plan: &FitPlan| {
            let stored = self.app.prepared.get(plan.key)?;
            Some(FitModel { plan: plan.clone(), stored })
        };
        let main = find(&self.plans.main)?;
        let surface = match self.plans.other() {
            Some(other) => Some(find(other)?),
            None => None,
        };
        let mut fits = Fits { app: self.app.clone(), main, surface, made: None };
        if self.plans.has_surface {
            fits.made = Some(fits.surface().stored.surface()?);
        }
        let memory = self.app.prepared.try_reserve(self.admission.owner, n_bytes_of_work(self.plans.cost))?;
        for fit in [Some(&fits.main), fits.surface.as_ref()].into_iter().flatten() {
            headers.found(CacheOutcome::Hit, fit.stored.times());
        }
        Some((fits, memory))
    }

    /// Tries once to reserve memory and to bring all fits.
    ///
    /// Returns `None` if the cache changed after the memory was counted, or if the memory was not enough.
    /// Then all memory goes back and is counted again.
    async fn attempt(
        &self,
        extents: &mut Extents,
        headers: &mut AnswerHeaders,
    ) -> Result<Option<(Fits, Reservation)>, Problem> {
        let Some(memory) = self.reserve(*extents).await? else { return Ok(None) };
        let fitted = self.fitted(&self.plans.main, memory.main, &mut extents.main, headers).await?;
        let Some(main) = fitted else { return Ok(None) };
        let mut fits = Fits { app: self.app.clone(), main, surface: None, made: None };
        if let Some(other) = self.plans.other() {
            fits.surface = self.fitted(other, memory.other, &mut extents.other, headers).await?;
            if fits.surface.is_none() {
                return Ok(None);
            }
        }
        if self.plans.has_surface {
            fits.made = self.surface(fits.surface(), memory.surface, headers).await?;
            if fits.made.is_none() {
                return Ok(None);
            }
        }
        Ok(Some((fits, memory.work)))
    }

    /// Reserves the memory of the request. Returns `None` if the missing parts changed during the wait.
    async fn reserve(&self, extents: Extents) -> Result<Option<Memory>, Problem> {
        let counted = self.count(extents);
        let work = n_bytes_of_work(self.plans.cost);
        let total = counted.into_iter().fold(work, usize::saturating_add);
        let is_wanted = || self.count(extents) == counted;
        let reserved = self.app.reserve(self.admission.owner, total, is_wanted).await?;
        let Some(mut work) = reserved else { return Ok(None) };
        let [main, other, surface] = counted.map(|n_bytes| (n_bytes > 0).then(|| work.split(n_bytes)));
        Ok(Some(Memory { work, main, other, surface }))
    }

    /// Returns what is missing now of the model and surface of each fit, with the price of making it.
    fn missing(&self) -> impl Iterator<Item = (Missing, MakingPrice)> {
        let (main, other) = (&self.plans.main, self.plans.other());
        // The last fit is the one of the surface.
        let of_surface = other.unwrap_or(main).key;
        [Some(main), other].into_iter().flatten().map(move |plan| {
            let with_surface = self.plans.has_surface && plan.key == of_surface;
            (self.app.prepared.missing(plan.key, with_surface), plan.price())
        })
    }

    /// Counts the bytes of the models and the surface that are missing now.
    fn count(&self, extents: Extents) -> [usize; 3] {
        let mut counted = [0; 3];
        let extents = [extents.main, extents.other];
        for (at, ((missing, price), extent)) in self.missing().zip(extents).enumerate() {
            if missing.solver {
                counted[at] = match extent {
                    Extent::Expected => price.expected.n_bytes,
                    Extent::AtMost => price.at_most.n_bytes,
                };
            }
            if missing.surface {
                counted[2] = price.surface.n_bytes;
            }
        }
        counted
    }

    /// Returns the work and memory of a request, as far as they can be foreseen.
    pub fn outlook(&self) -> Outlook {
        let cost = self.plans.cost;
        let mut outlook = Outlook { flops: cost.flops(), n_bytes: n_bytes_of_work(cost), is_cached: true };
        for (missing, price) in self.missing() {
            let parts = [(missing.solver, price.expected), (missing.surface, price.surface)];
            for (_, price) in parts.into_iter().filter(|(is_missing, _)| *is_missing) {
                outlook.flops += price.flops;
                outlook.n_bytes = outlook.n_bytes.saturating_add(price.n_bytes);
                outlook.is_cached = false;
            }
        }
        outlook
    }

    /// Finds or makes a model.
    ///
    /// Returns `None` if the model has to be made and there is no memory for it. Returns `None` also if
    /// making it needs more, and raises `extent`.
    async fn fitted(
        &self,
        plan: &FitPlan,
        memory: Option<Reservation>,
        extent: &mut Extent,
        headers: &mut AnswerHeaders,
    ) -> Result<Option<FitModel>, Problem> {
        let begin =
            |memory: Reservation| prepare(self.app.clone(), self.admission.clone(), plan.clone(), memory);
        match self.app.prepared.get_or_prepare(plan.key, memory, begin).await {
            Ok(Some((stored, outcome))) => {
                if matches!(outcome, CacheOutcome::Stored | CacheOutcome::NotStored) {
                    self.app.solvers.with_label_values(&stored.labels()).inc();
                    factors::keep(self.app, plan, &stored);
                }
                let is_read = stored.is_restored() && outcome != CacheOutcome::Hit;
                if is_read || outcome == CacheOutcome::Collapsed {
                    // The time for reading a factor, or for waiting for that of another request, does not
                    // predict the time for making one.
                    self.admission.forget_work();
                }
                headers.found(outcome, stored.times());
                Ok(Some(FitModel { plan: plan.clone(), stored }))
            }
            Ok(None) => Ok(None),
            Err(FitFailure::NeedsAll) => {
                *extent = Extent::AtMost;
                Ok(None)
            }
            Err(failure) => Err(plan.failed(failure)),
        }
    }

    /// Finds or makes a surface. Returns `None` if it has to be made and there is no memory for it.
    async fn surface(
        &self,
        fit: &FitModel,
        memory: Option<Reservation>,
        headers: &mut AnswerHeaders,
    ) -> Result<Option<Arc<Surface>>, Problem> {
        let fits = &self.app.prepared;
        let (key, times) = (fit.plan.key, Arc::new(OnceLock::new()));
        let was_missing = memory.is_some();
        let begin = |memory: Reservation| {
            make_surface(self.app.clone(), self.admission.clone(), fit, times.clone(), memory)
        };
        let found = fits.get_or_make_surface(key, &fit.stored, memory, begin).await;
        match times.get() {
            Some(&times) => headers.worked(times),
            // Another request made it.
            None if was_missing => self.admission.forget_work(),
            None => {}
        }
        found.map_err(|failure| fit.plan.failed(failure))
    }
}

/// Amount of memory reserved for a model.
#[derive(Clone, Copy)]
enum Extent {
    /// Enough in nearly all cases. The solver takes the rest as well if it is free at that moment.
    Expected,
    /// All that the model may need, from the start, because it is known to need it.
    AtMost,
}

/// Amounts of memory reserved for the models of one request.
#[derive(Clone, Copy)]
struct Extents {
    main: Extent,
    other: Extent,
}

fn n_bytes_of_work(cost: Cost) -> usize {
    LEAST_BYTES.saturating_add(cost.n_bytes())
}

async fn prepare(
    app: Arc<App>,
    admission: Arc<Admission>,
    plan: FitPlan,
    mut memory: Reservation,
) -> Result<PreparedFit, FitFailure> {
    if let Some(model) = plan.recipe.made_at_once() {
        return Ok(PreparedFit::at_once(model, memory));
    }
    if let Some(model) = retuned(&app, &plan) {
        return Ok(PreparedFit::at_once(model, memory));
    }
    if let Some(model) = factors::restore(&app, &admission, &plan).await {
        return Ok(PreparedFit::restored(model, memory));
    }
    let flops = plan.price().at_most.flops;
    let sampling = if plan.recipe.needs_sampling() {
        sampling_unless_merged(&app, &admission, &plan).await?
    } else {
        None
    };
    let spare = app.prepared.spare().clone();
    let job = move |observer: &JobObserver| {
        let (n_taken, mut is_short) = (memory.n_bytes(), false);
        // The job holds memory already, so it never waits for more.
        let mut may_take = |n_bytes: usize| {
            is_short = n_bytes > n_taken && !memory.try_grow(n_bytes - n_taken);
            !is_short
        };
        let workspace = Workspace { spare: &spare, may_take: &mut may_take };
        let making = Making { cloud: plan.fitted, sampling, workspace };
        match plan.recipe.make(making, observer) {
            // The memory goes with the job, which may run on for a moment after the last client has left.
            Ok(model) => Ok((model, memory)),
            Err(_) if is_short => Err(FitFailure::NeedsAll),
            Err(error) => Err(FitFailure::Refused(error)),
        }
    };
    let (outcome, times) = app.compute.run(&admission, flops, job).await.map_err(FitFailure::Broken)?;
    let (model, memory) = outcome?;
    Ok(PreparedFit::new(model, times.gram, times.factor, memory))
}

/// Makes the model from a cached one that differs in its tolerance alone. What they share is reserved by
/// both, so that either may be evicted.
fn retuned(app: &App, plan: &FitPlan) -> Option<Model> {
    let found = app.prepared.to_another_tolerance(plan.key)?;
    found.model().with_tolerance(plan.recipe.tolerance()?)
}

/// Returns the cached sampling, or `None` if duplicates were merged. The merged cloud is not registered.
async fn sampling_unless_merged(
    app: &Arc<App>,
    admission: &Arc<Admission>,
    plan: &FitPlan,
) -> Result<Option<Arc<Sampling>>, FitFailure> {
    match plan.merge {
        None => find_sampling(app, admission, &plan.stored).await.map(Some).map_err(FitFailure::Broken),
        Some(_) => Ok(None),
    }
}

/// Makes the surface, with the client's normals if there are any.
fn make_surface(
    app: Arc<App>,
    admission: Arc<Admission>,
    fit: &FitModel,
    times: Arc<OnceLock<StageTimes>>,
    memory: Reservation,
) -> impl Future<Output = Result<(Surface, Reservation), FitFailure>> + Send + 'static {
    let (plan, stored) = (fit.plan.clone(), fit.stored.clone());
    let flops = plan.price().surface.flops;
    async move {
        let sampling = sampling_unless_merged(&app, &admission, &plan).await?;
        let shared = app.clone();
        let job = move |observer: &JobObserver| {
            let sampling = match sampling {
                Some(sampling) => sampling,
                None => Arc::new(Sampling::of(&plan.fitted, observer)?),
            };
            let normals = plan.fitted_normals();
            let given = LocalInputs { normals: normals.as_deref(), learning: plan.recipe.learning() };
            let ones = ValuesKey::of(&vec![1.0; plan.stored.cloud.n_points()]);
            let signature = shared.prepared.known(plan.key, ones);
            let is_new = signature.these.is_none();
            let making = SurfaceMaking { cloud: &plan.fitted, sampling, given, signature };
            let surface = stored.model().surface(making, observer)?;
            if let Some(signature) = surface.signature().filter(|_| is_new) {
                shared.prepared.keep_solution(plan.key, ones, signature.solution.clone());
            }
            // The memory goes with the job, which may run on for a moment after the last client has left.
            Ok((surface, memory))
        };
        let (surface, taken) = app.compute.run(&admission, flops, job).await.map_err(FitFailure::Broken)?;
        let _ = times.set(taken);
        surface.map_err(FitFailure::Refused)
    }
}
