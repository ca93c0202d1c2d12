//! Factorizations and the weights solved with them.

use std::sync::{Arc, OnceLock};
use std::time::Duration;

use moka::ops::compute::Op;
use moka::sync::Cache;

use super::key::{CloudId, FactorKey, ValuesKey};
use super::single_flight::{Boarding, SingleFlight};
use super::{Owner, bounded_cache, n_bytes_of};
use crate::numerics::heap::{arc_payload, block_bytes};
use crate::numerics::memory::SpareBuffer;
use crate::numerics::solver::{GramFactor, Solution};
use crate::numerics::surface::Surface;

/// The share of the cache that weights may take: they are n numbers beside the n² of a factor.
const WEIGHTS_SHARE: u64 = 16;

/// The share of the cache that memory kept for the next factorization may take.
const SPARE_SHARE: u64 = 8;

/// A factorization with the surface of its cloud, once that was asked for, and the time it took.
pub struct StoredFactor {
    pub factor: Arc<GramFactor>,
    pub gram_time: Duration,
    pub factor_time: Duration,
    surface: OnceLock<Arc<Surface>>,
}

impl StoredFactor {
    pub fn new(factor: GramFactor, gram_time: Duration, factor_time: Duration) -> Self {
        Self { factor: Arc::new(factor), gram_time, factor_time, surface: OnceLock::new() }
    }

    /// The surface of the signature function, made at most once unless two ask at the same moment.
    ///
    /// # Errors
    /// Those of `make`; they are not kept.
    pub fn surface<E>(&self, make: impl FnOnce() -> Result<Surface, E>) -> Result<Arc<Surface>, E> {
        if let Some(found) = self.surface.get() {
            return Ok(found.clone());
        }
        let made = Arc::new(make()?);
        Ok(self.surface.get_or_init(|| made).clone())
    }

    /// Whether the surface was made.
    pub fn has_surface(&self) -> bool {
        self.surface.get().is_some()
    }

    /// Bytes held on the heap, those of the surface once there is one.
    fn n_bytes(&self) -> usize {
        let own = block_bytes(arc_payload::<Self>()) + block_bytes(arc_payload::<GramFactor>());
        own + self.factor.n_bytes() + self.surface.get().map_or(0, |surface| surface.n_bytes())
    }
}

/// Where a factor came from, in the terms of RFC 9211.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CacheOutcome {
    Hit,
    /// Computed for another request at the same time.
    Collapsed,
    /// Computed for this request and kept.
    Stored,
    /// Computed for this request, larger than the whole cache.
    NotStored,
}

/// Factorizations and weights within one byte budget. `E` is what a computation may fail with.
pub struct FactorStore<E> {
    factors: Cache<FactorKey, Arc<StoredFactor>>,
    solutions: Cache<(FactorKey, ValuesKey), Arc<Solution>>,
    flights: SingleFlight<FactorKey, (Arc<StoredFactor>, bool), E>,
    max_factor_bytes: u64,
    spare: Arc<SpareBuffer>,
}

impl<E: Clone + Send + Sync + 'static> FactorStore<E> {
    pub fn new(max_bytes: u64) -> Self {
        let max_solution_bytes = max_bytes / WEIGHTS_SHARE;
        let max_spare_bytes = max_bytes / SPARE_SHARE;
        let max_factor_bytes = max_bytes - max_solution_bytes - max_spare_bytes;
        Self {
            factors: bounded_cache(max_factor_bytes, |f: &Arc<StoredFactor>| f.n_bytes()).build(),
            solutions: bounded_cache(max_solution_bytes, |solution: &Arc<Solution>| {
                block_bytes(arc_payload::<Solution>()) + solution.n_bytes()
            })
            .build(),
            flights: SingleFlight::new(),
            max_factor_bytes,
            spare: SpareBuffer::up_to(usize::try_from(max_spare_bytes).unwrap_or(usize::MAX)),
        }
    }

    /// The memory of factors that were let go.
    pub fn spare(&self) -> &Arc<SpareBuffer> {
        &self.spare
    }

    /// Returns the factor of `key`, computing it at most once however many ask, and where it came from.
    ///
    /// # Errors
    /// Those of `factorize`; they are not kept.
    pub async fn get_or_factorize<F>(
        &self,
        key: FactorKey,
        factorize: impl FnOnce() -> F,
    ) -> Result<(Arc<StoredFactor>, CacheOutcome), E>
    where
        F: Future<Output = Result<StoredFactor, E>> + Send + 'static,
    {
        if let Some(found) = self.factors.get(&key) {
            return Ok((found, CacheOutcome::Hit));
        }
        let (factors, max_bytes) = (self.factors.clone(), self.max_factor_bytes);
        let (boarding, outcome) = self
            .flights
            .join(key, || {
                let computation = factorize();
                async move {
                    // A flight may have landed between the look-up and this one's beginning.
                    if let Some(found) = factors.get(&key) {
                        return Ok((found, true));
                    }
                    let stored = Arc::new(computation.await?);
                    let is_kept = stored.n_bytes() as u64 <= max_bytes;
                    if is_kept {
                        factors.insert(key, stored.clone());
                        factors.run_pending_tasks();
                    }
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
        Ok((stored, outcome))
    }

    /// Whether a factorization is neither kept nor being computed: asking for it would begin a new one.
    pub fn is_missing(&self, key: FactorKey) -> bool {
        !self.factors.contains_key(&key) && !self.flights.is_under_way(&key)
    }

    /// The weights of values solved before.
    pub fn solution(&self, key: FactorKey, values: ValuesKey) -> Option<Arc<Solution>> {
        self.solutions.get(&(key, values))
    }

    pub fn keep_solution(&self, key: FactorKey, values: ValuesKey, solution: Arc<Solution>) {
        self.solutions.insert((key, values), solution);
    }

    /// Weighs a factor again, whose surface was made since it was kept.
    pub fn reweigh(&self, key: FactorKey) {
        // Putting the value back is how moka weighs again; what was evicted or forgotten meanwhile stays away.
        self.factors.entry(key).and_compute_with(|kept| match kept {
            Some(entry) => Op::Put(entry.into_value()),
            None => Op::Nop,
        });
    }

    /// Bytes of all factors and weights that are kept.
    pub fn n_bytes(&self) -> u64 {
        n_bytes_of(&self.factors) + n_bytes_of(&self.solutions) + self.spare.n_bytes() as u64
    }

    /// Forgets everything that was computed from a cloud.
    pub fn forget_cloud(&self, owner: Owner, id: CloudId) {
        let is_of_cloud = move |key: &FactorKey| key.owner == owner && key.cloud_id == id;
        // The caches were built with support for closures, so these cannot be refused.
        let _ = self.factors.invalidate_entries_if(move |key, _| is_of_cloud(key));
        let _ = self.solutions.invalidate_entries_if(move |(key, _), _| is_of_cloud(key));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::cloud::Cloud;
    use crate::numerics::kernel::{Family, Kernel};
    use crate::numerics::observer::Unobserved;
    use crate::numerics::regularization::Regularization;

    fn key(alpha: f64) -> FactorKey {
        let cloud = Cloud::new(vec![0.0, 1.0], 1).unwrap();
        let kernel = Kernel::new(Family::Gauss, 1.0, 1.0).unwrap();
        let id = CloudId::of(&cloud, None);
        FactorKey::of_dense(Owner(0), id, &kernel, &Regularization::Uniform(alpha), false)
    }

    async fn factorize(n: usize) -> Result<StoredFactor, &'static str> {
        let cloud = Arc::new(Cloud::new((0..n).map(|i| i as f64).collect(), 1).unwrap());
        let kernel = Kernel::new(Family::Gauss, 1.0, 1.0).unwrap();
        let factor = GramFactor::factorize(cloud, kernel, Regularization::Uniform(1.0), &Unobserved).unwrap();
        Ok(StoredFactor::new(factor, Duration::ZERO, Duration::ZERO))
    }

    #[tokio::test]
    async fn the_second_request_is_a_hit_until_the_cloud_is_forgotten() {
        let store = FactorStore::<&str>::new(1 << 20);
        let outcome = async |n| store.get_or_factorize(key(1.0), || factorize(n)).await.map(|found| found.1);
        assert_eq!(outcome(10).await, Ok(CacheOutcome::Stored));
        assert_eq!(outcome(10).await, Ok(CacheOutcome::Hit));
        store.forget_cloud(Owner(0), key(1.0).cloud_id);
        assert_eq!(outcome(10).await, Ok(CacheOutcome::Stored));
    }

    #[tokio::test]
    async fn a_failure_does_not_poison_the_key() {
        let store = FactorStore::<&str>::new(1 << 20);
        let failed = store.get_or_factorize(key(1.0), || async { Err("no") }).await;
        assert_eq!(failed.err(), Some("no"));
        let found = store.get_or_factorize(key(1.0), || factorize(10)).await;
        assert_eq!(found.map(|f| f.1), Ok(CacheOutcome::Stored));
    }

    #[tokio::test]
    async fn the_bytes_of_all_factors_stay_within_the_budget() {
        // 100 points take 50 · 112 · 8 bytes = 44 KiB in a block of 48; the budget holds two, not three.
        let store = FactorStore::<&str>::new(150 << 10);
        for alpha in [1.0, 2.0, 3.0] {
            store.get_or_factorize(key(alpha), || factorize(100)).await.map(|_| ()).unwrap();
        }
        let is_hit = async |alpha| {
            let found = store.get_or_factorize(key(alpha), || async { Err("absent") }).await;
            found.is_ok_and(|f| f.1 == CacheOutcome::Hit)
        };
        assert!(!is_hit(1.0).await && is_hit(2.0).await && is_hit(3.0).await);
    }

    #[tokio::test]
    async fn a_factor_beyond_the_budget_is_served_and_not_kept() {
        let store = FactorStore::<&str>::new(20 << 10);
        for _ in 0..2 {
            let found = store.get_or_factorize(key(1.0), || factorize(100)).await;
            assert_eq!(found.map(|f| f.1), Ok(CacheOutcome::NotStored));
        }
    }
}
