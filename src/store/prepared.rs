//! Cache of the models and surfaces that fits are served from, and of the weights solved with them.

use std::ops::ControlFlow;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use super::key::{CloudId, FitKey, ValuesKey};
use gramian_host::compute::StageTimes;
use gramian_host::memory::budget::{BeyondBudget, Budget, Reservation, Shortage};
use gramian_host::memory::fair_cache::{Counts, FairCache};
use gramian_host::memory::single_flight::{Boarding, SingleFlight};
use gramian_host::memory::{CacheOutcome, Owner};
use gramian_numerics::machine::heap::{arc_payload, block_bytes};
use gramian_numerics::machine::pages::SpareBuffer;
use gramian_numerics::model::Model;
use gramian_numerics::model::kind::{ModelKind, Serves};
use gramian_numerics::regression::solver::{EarlierSolutions, Solution, Solver};
use gramian_numerics::surface::Surface;

/// Divisor of the cache size that gives the share of weights: they are n numbers beside the n² of a dense
/// solver.
const WEIGHTS_SHARE: usize = 16;

/// Earlier solutions from which a new one may start. Their vectors fit into the memory of the iteration.
const EARLIER: usize = 4;

/// A model, the surface of its cloud once that was needed, and the time to make the model.
///
/// It holds its reserved memory for as long as anything refers to it, cached or not.
pub struct PreparedFit {
    model: Model,
    pub gram_time: Duration,
    pub factor_time: Duration,
    /// Whether the model was read from the store, not made.
    is_restored: bool,
    surface: OnceLock<PreparedSurface>,
    memory: Arc<Reservation>,
}

/// A surface with its reserved memory, and that of the solver from which it was made.
///
/// That solver may be an equal one that was evicted since.
#[derive(Clone)]
struct PreparedSurface {
    surface: Arc<Surface>,
    memory: Arc<Reservation>,
    _solver_memory: Arc<Reservation>,
}

impl PreparedFit {
    /// Wraps a model that was made in `memory`. Memory that the model does not need goes back.
    pub fn new(model: Model, gram_time: Duration, factor_time: Duration, mut memory: Reservation) -> Self {
        memory.shrink_to(model.n_bytes());
        let (surface, memory) = (OnceLock::new(), Arc::new(memory));
        Self { model, gram_time, factor_time, is_restored: false, surface, memory }
    }

    /// Wraps a model that took no time: made without work, or read from the store.
    pub fn at_once(model: Model, memory: Reservation) -> Self {
        Self::new(model, Duration::ZERO, Duration::ZERO, memory)
    }

    /// Wraps a model that was made before and read from the store.
    pub fn restored(model: Model, memory: Reservation) -> Self {
        Self { is_restored: true, ..Self::at_once(model, memory) }
    }

    /// Returns whether the model was read from the store, not made.
    pub fn is_restored(&self) -> bool {
        self.is_restored
    }

    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Times of the stages in which the model was made.
    pub fn times(&self) -> StageTimes {
        StageTimes { gram: self.gram_time, factor: self.factor_time, ..StageTimes::default() }
    }

    /// Labels of the model in the metrics.
    pub fn labels(&self) -> [&'static str; 2] {
        labels(if self.is_restored { None } else { Some(self.model.kind()) })
    }

    /// Returns the surface, once it was made.
    pub fn surface(&self) -> Option<Arc<Surface>> {
        self.surface.get().map(|stored| stored.surface.clone())
    }

    /// Bytes held on the heap, including those of the surface once there is one.
    fn n_bytes(&self) -> usize {
        let own = block_bytes(arc_payload::<Self>()) + block_bytes(arc_payload::<Solver>());
        own + self.model.n_bytes() + self.surface().map_or(0, |surface| surface.n_bytes())
    }

    /// Bytes that are given back when the fit is dropped.
    fn n_reserved(&self) -> usize {
        self.memory.n_bytes() + self.surface.get().map_or(0, |stored| stored.memory.n_bytes())
    }
}

/// Labels `kind` and `of` of a model in the metrics. A model that was read from the store has no kind.
pub fn labels(kind: Option<ModelKind>) -> [&'static str; 2] {
    match kind {
        Some(kind) => [kind.into(), kind.serves().into()],
        None => ["restored", Serves::Both.into()],
    }
}

/// Byte limits of a [`PreparedStore`].
#[derive(Debug, Clone, Copy)]
pub struct PreparedBytes {
    /// Largest size of cached solvers, surfaces and weights.
    pub kept: usize,
    /// Largest size of the buffer that is kept for the next factorization, besides the budget.
    pub spare: usize,
}

/// Cache of models, surfaces and weights within one byte budget. The budget includes the work done with them.
///
/// `E` is the error of a computation.
pub struct PreparedStore<E> {
    fits: Arc<FairCache<FitKey, Arc<PreparedFit>>>,
    solutions: FairCache<(FitKey, ValuesKey), Arc<KeptSolution>>,
    flights: SingleFlight<FitKey, (Arc<PreparedFit>, bool), E>,
    surfaces: SingleFlight<FitKey, PreparedSurface, E>,
    budget: Budget,
    spare: Arc<SpareBuffer>,
}

struct KeptSolution {
    solution: Arc<Solution>,
    memory: Reservation,
}

impl<E: Clone + Send + Sync + 'static> PreparedStore<E> {
    /// Creates an empty cache. What it keeps is reserved from `budget`, like the work done with it.
    pub fn new(bytes: PreparedBytes, budget: Budget) -> Self {
        let solutions = bytes.kept / WEIGHTS_SHARE;
        Self {
            fits: Arc::new(FairCache::new(bytes.kept - solutions)),
            solutions: FairCache::new(solutions),
            flights: SingleFlight::default(),
            surfaces: SingleFlight::default(),
            budget,
            spare: SpareBuffer::up_to(bytes.spare),
        }
    }

    /// Largest number of bytes for work that one owner may have.
    pub fn memory(&self) -> usize {
        self.budget.largest()
    }

    /// Returns the buffer that recycles the memory of evicted solvers.
    pub fn spare(&self) -> &Arc<SpareBuffer> {
        &self.spare
    }

    /// Waits for `n_bytes` bytes of memory for work, as long as they are wanted.
    ///
    /// Cached entries that are not in use make room. Before anything is evicted, `is_wanted` is called again.
    /// Returns `None` once it is false. A caller that waits must hold no other memory of this store, nor wait
    /// for anybody who does.
    ///
    /// # Errors
    /// Returns [`BeyondBudget`] if the budget can never hold so many.
    pub async fn reserve(
        &self,
        owner: Owner,
        n_bytes: usize,
        is_wanted: impl Fn() -> bool,
    ) -> Result<Option<Reservation>, BeyondBudget> {
        let look = |shortage: Option<Shortage>| {
            if !is_wanted() {
                return ControlFlow::Break(());
            }
            if let Some(shortage) = shortage {
                self.make_room(shortage);
            }
            ControlFlow::Continue(())
        };
        self.budget.reserve(owner, n_bytes, look).await
    }

    /// Reserves memory for work if it is free, without waiting and without eviction.
    pub fn try_reserve(&self, owner: Owner, n_bytes: usize) -> Option<Reservation> {
        self.budget.try_reserve(owner, n_bytes)
    }

    /// Returns the fit for `key`, if it is cached.
    pub fn get(&self, key: FitKey) -> Option<Arc<PreparedFit>> {
        self.fits.get(key.owner, &key)
    }

    /// Evicts the least recently used entries.
    ///
    /// Entries of the owner who needs memory go first, if that owner exceeds the share. Then entries of the
    /// owner who holds most go.
    fn make_room(&self, shortage: Shortage) {
        let let_go = |owner: Option<Owner>, mut n_bytes: usize| {
            while n_bytes > 0 {
                let fit = self.fits.evict(owner, |fit| Arc::strong_count(fit) == 1);
                let freed = fit.map(|fit| fit.n_reserved()).or_else(|| {
                    let kept = self.solutions.evict(owner, |kept| Arc::strong_count(kept) == 1)?;
                    Some(kept.memory.n_bytes())
                });
                let Some(freed) = freed else { return };
                n_bytes = n_bytes.saturating_sub(freed);
            }
        };
        let_go(Some(shortage.owner), shortage.of_owner);
        let_go(None, shortage.of_all.saturating_sub(shortage.of_owner));
    }

    /// Returns the fit for `key` and its origin, computing it at most once for all concurrent callers.
    ///
    /// The caller that begins computes in `memory`. It goes back if another caller has begun. Without memory
    /// nothing is begun, and `None` says that memory is needed.
    ///
    /// # Errors
    /// Returns the errors of `prepare`. They are not cached.
    pub async fn get_or_prepare<F>(
        &self,
        key: FitKey,
        memory: Option<Reservation>,
        prepare: impl FnOnce(Reservation) -> F,
    ) -> Result<Option<(Arc<PreparedFit>, CacheOutcome)>, E>
    where
        F: Future<Output = Result<PreparedFit, E>> + Send + 'static,
    {
        if let Some(found) = self.fits.get(key.owner, &key) {
            return Ok(Some((found, CacheOutcome::Hit)));
        }
        let Some(memory) = memory else {
            let Some(outcome) = self.flights.join_if_under_way(&key).await else { return Ok(None) };
            return Ok(Some((outcome?.0, CacheOutcome::Collapsed)));
        };
        let fits = self.fits.clone();
        let (boarding, outcome) = self
            .flights
            .join(key, || {
                let computation = prepare(memory);
                async move {
                    // Another flight may have landed between the look-up and the start of this one.
                    if let Some(found) = fits.get(key.owner, &key) {
                        return Ok((found, true));
                    }
                    let stored = Arc::new(computation.await?);
                    let is_kept = fits.insert(key.owner, key, stored.clone(), stored.n_bytes());
                    Ok((stored, is_kept))
                }
            })
            .await;
        let (stored, is_kept) = outcome?;
        let outcome = match (boarding, is_kept) {
            (Boarding::Joined, _) => CacheOutcome::Collapsed,
            (Boarding::Began, true) => CacheOutcome::Stored,
            (Boarding::Began, false) => CacheOutcome::NotStored,
        };
        Ok(Some((stored, outcome)))
    }

    /// Returns the surface of a fit, making it at most once for all concurrent callers.
    ///
    /// The work takes `memory`, of which the surface keeps what it needs. Without memory it is not begun, and
    /// `None` says that memory is needed.
    ///
    /// # Errors
    /// Returns the errors of `make`. They are not cached.
    pub async fn get_or_make_surface<F>(
        &self,
        key: FitKey,
        stored: &PreparedFit,
        memory: Option<Reservation>,
        make: impl FnOnce(Reservation) -> F,
    ) -> Result<Option<Arc<Surface>>, E>
    where
        F: Future<Output = Result<(Surface, Reservation), E>> + Send + 'static,
    {
        if let Some(found) = stored.surface() {
            return Ok(Some(found));
        }
        let found = match memory {
            None => match self.surfaces.join_if_under_way(&key).await {
                None => return Ok(None),
                Some(outcome) => outcome?,
            },
            Some(memory) => {
                let solver_memory = stored.memory.clone();
                let begin = || {
                    let making = make(memory);
                    async move {
                        let (surface, mut memory) = making.await?;
                        let surface = Arc::new(surface);
                        memory.shrink_to(surface.n_bytes());
                        Ok(PreparedSurface {
                            surface,
                            memory: Arc::new(memory),
                            _solver_memory: solver_memory,
                        })
                    }
                };
                self.surfaces.join(key, begin).await.1?
            }
        };
        let surface = found.surface.clone();
        if stored.surface.set(found).is_ok() {
            self.fits.reweigh(key.owner, key, stored.n_bytes());
        }
        Ok(Some(surface))
    }

    /// Returns what is missing now of a solver, and of its surface where `with_surface` is set.
    pub fn missing(&self, key: FitKey, with_surface: bool) -> Missing {
        let solver = match self.fits.get(key.owner, &key) {
            Some(stored) if stored.surface.get().is_some() || !with_surface => return Missing::default(),
            Some(_) => false,
            None => !self.flights.is_under_way(&key),
        };
        Missing { solver, surface: with_surface && !self.surfaces.is_under_way(&key) }
    }

    /// Returns a cached fit of the same system to another tolerance, whose preparation serves this one too.
    pub fn to_another_tolerance(&self, key: FitKey) -> Option<Arc<PreparedFit>> {
        self.fits.latest(key.owner, 1, |other| key.is_iterated_like(other)).pop()
    }

    /// Returns the cached weights of values that were solved before, or the latest of others.
    pub fn known(&self, key: FitKey, values: ValuesKey) -> EarlierSolutions {
        let these = self.solutions.get(key.owner, &(key, values)).map(|kept| kept.solution.clone());
        if these.is_some() {
            return EarlierSolutions { these, earlier: Vec::new() };
        }
        let latest = self.solutions.latest(key.owner, EARLIER, |(other, _)| key.is_iterated_like(other));
        EarlierSolutions { these, earlier: latest.into_iter().map(|kept| kept.solution.clone()).collect() }
    }

    /// Caches weights, if memory for them is free.
    pub fn keep_solution(&self, key: FitKey, values: ValuesKey, solution: Arc<Solution>) {
        let own = block_bytes(arc_payload::<KeptSolution>()) + block_bytes(arc_payload::<Solution>());
        let n_bytes = own + solution.n_bytes();
        if let Some(memory) = self.budget.try_reserve(key.owner, n_bytes) {
            let kept = Arc::new(KeptSolution { solution, memory });
            self.solutions.insert(key.owner, (key, values), kept, n_bytes);
        }
    }

    /// Bytes of all cached solvers, surfaces and weights, and of the buffer for the next factorization.
    pub fn n_bytes(&self) -> usize {
        self.fits.n_bytes() + self.solutions.n_bytes() + self.spare.n_bytes()
    }

    /// Number of cached solvers, and number of solvers evicted for others or for work.
    pub fn counts(&self) -> Counts {
        self.fits.counts()
    }

    /// Bytes of the budget that are held, by cached entries and by work.
    pub fn n_reserved(&self) -> usize {
        self.budget.n_held()
    }

    /// Drops everything that was computed from a cloud.
    pub fn forget_cloud(&self, owner: Owner, id: CloudId) {
        self.fits.remove_if(owner, |key| key.cloud_id == id);
        self.solutions.remove_if(owner, |(key, _)| key.cloud_id == id);
    }
}

/// Parts that a request would have to make.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Missing {
    pub solver: bool,
    pub surface: bool,
}

#[cfg(test)]
mod tests;
