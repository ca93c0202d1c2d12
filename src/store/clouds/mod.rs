//! Registered clouds, named by their content: the cache in memory, and their transitions when there is a
//! store (durable.rs, page.rs).

mod durable;
#[cfg(test)]
mod interleavings;
mod page;
mod registered;
mod turns;

use std::sync::{Arc, OnceLock};

use super::key::CloudId;
pub use durable::{CloudLookup, Holder, StoreOutcome};
use gramian_host::memory::Owner;
use gramian_host::memory::fair_cache::{Counts, FairCache};
use gramian_host::memory::single_flight::{Boarding, SingleFlight};
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
pub use page::{CloudPage, ListedCloud};
pub use registered::RegisteredCloud;
use turns::FairSemaphore;

/// The clouds of all owners within one byte budget. `E` is the error of a computation.
pub struct CloudStore<E> {
    clouds: FairCache<CloudId, Arc<RegisteredCloud>>,
    samplings: SingleFlight<(Owner, CloudId), Arc<Sampling>, E>,
    noise: SingleFlight<(Owner, CloudId), f64, E>,
    landmarks: SingleFlight<(Owner, CloudId, [u8; 32]), Option<usize>, E>,
    reads: SingleFlight<(Owner, CloudId), Option<Arc<RegisteredCloud>>, E>,
    turns: FairSemaphore<(Owner, CloudId)>,
}

impl<E: Clone + Send + Sync + 'static> CloudStore<E> {
    pub fn new(max_bytes: usize) -> Self {
        Self {
            clouds: FairCache::sparing(max_bytes, |cloud| cloud.is_pending()),
            samplings: SingleFlight::default(),
            noise: SingleFlight::default(),
            landmarks: SingleFlight::default(),
            reads: SingleFlight::default(),
            turns: FairSemaphore::default(),
        }
    }

    /// Registers a cloud, or finds it. Returns it and whether it is new. A cloud larger than the whole budget
    /// is returned but not kept.
    pub fn register(
        &self,
        owner: Owner,
        cloud: Cloud,
        normals: Option<Cloud>,
    ) -> (Arc<RegisteredCloud>, bool) {
        let id = CloudId::of(&cloud, normals.as_ref());
        if let Some(found) = self.clouds.get(owner, &id) {
            return (found, false);
        }
        let stored = Arc::new(RegisteredCloud::new(id, cloud, normals));
        self.clouds.get_or_insert(owner, id, stored, |stored| stored.n_bytes())
    }

    /// Returns the cloud from memory, or else the result of `read`. Concurrent callers share one read.
    ///
    /// # Errors
    /// Returns the errors of `read`. They are not cached.
    pub async fn get_or_read<F>(
        &self,
        owner: Owner,
        id: CloudId,
        read: impl Fn() -> F,
    ) -> Result<Option<Arc<RegisteredCloud>>, E>
    where
        F: Future<Output = Result<Option<Arc<RegisteredCloud>>, E>> + Send + 'static,
    {
        let find = async || match self.clouds.get(owner, &id) {
            Some(found) => (Boarding::Began, Ok(Some(found))),
            None => self.reads.join((owner, id), &read).await,
        };
        match find().await {
            // The joined flight may have looked before this request came, and the cloud may have been posted
            // in between. A second flight starts later than that.
            (Boarding::Joined, Ok(None)) => find().await.1,
            (_, found) => found,
        }
    }

    /// Returns whether memory holds this very cloud, and not another copy of the same points.
    pub fn has(&self, owner: Owner, cloud: &Arc<RegisteredCloud>) -> bool {
        self.clouds.peek(owner, &cloud.id).is_some_and(|kept| Arc::ptr_eq(&kept, cloud))
    }

    pub fn get(&self, owner: Owner, id: CloudId) -> Option<Arc<RegisteredCloud>> {
        self.clouds.get(owner, &id)
    }

    /// Returns the sampling of a cloud. Concurrent callers share one run of `compute`, and its result is
    /// kept.
    ///
    /// # Errors
    /// Returns the errors of `compute`. They are not cached.
    pub async fn sampling<F>(
        &self,
        owner: Owner,
        stored: &RegisteredCloud,
        compute: impl FnOnce() -> F,
    ) -> Result<Arc<Sampling>, E>
    where
        F: Future<Output = Result<Sampling, E>> + Send + 'static,
    {
        let begin = || {
            let found = compute();
            async move { found.await.map(Arc::new) }
        };
        let (sampling, is_new) = fill(&stored.sampling, &self.samplings, (owner, stored.id), begin).await?;
        if is_new {
            // A cached cloud stays cached. If its sampling has no room beside it, it keeps its old weight.
            self.clouds.reweigh(owner, stored.id, stored.n_bytes());
        }
        Ok(sampling)
    }

    /// Makes sure that the noise of the cloud is known. Concurrent callers share one run of `compute`.
    ///
    /// # Errors
    /// Returns the errors of `compute`. They are not cached.
    pub async fn noise<F>(
        &self,
        owner: Owner,
        stored: &RegisteredCloud,
        compute: impl FnOnce() -> F,
    ) -> Result<(), E>
    where
        F: Future<Output = Result<f64, E>> + Send + 'static,
    {
        fill(&stored.noise, &self.noise, (owner, stored.id), compute).await?;
        Ok(())
    }

    /// Returns the number of landmarks that a kernel needs, if these are few. `key` is that of kernel and
    /// noise. Concurrent callers share one run of `compute`, and its result is kept.
    ///
    /// # Errors
    /// Returns the errors of `compute`. They are not cached.
    pub async fn landmarks<F>(
        &self,
        owner: Owner,
        stored: &RegisteredCloud,
        key: [u8; 32],
        compute: impl FnOnce() -> F,
    ) -> Result<Option<usize>, E>
    where
        F: Future<Output = Result<Option<usize>, E>> + Send + 'static,
    {
        if let Some(known) = stored.landmarks(key) {
            return Ok(known);
        }
        let found = self.landmarks.join((owner, stored.id, key), compute).await.1?;
        stored.set_landmarks(key, found);
        Ok(found)
    }

    /// Bytes of all clouds in memory.
    pub fn n_bytes(&self) -> usize {
        self.clouds.n_bytes()
    }

    /// Numbers of clouds kept now and evicted since the start.
    pub fn counts(&self) -> Counts {
        self.clouds.counts()
    }

    /// Clouds of an owner that are in memory and not in the store, as far as this process knows. Without a
    /// store these are all clouds.
    pub fn unstored(&self, owner: Owner) -> Vec<Arc<RegisteredCloud>> {
        let mut clouds = self.clouds.values(owner);
        clouds.retain(|cloud| !cloud.is_stored());
        clouds
    }
}

/// Returns the content of a cell, filled by a flight if it is empty, and whether this call filled it.
async fn fill<T, E, F>(
    cell: &OnceLock<T>,
    flights: &SingleFlight<(Owner, CloudId), T, E>,
    key: (Owner, CloudId),
    compute: impl FnOnce() -> F,
) -> Result<(T, bool), E>
where
    T: Clone + Send + Sync + 'static,
    E: Clone + Send + Sync + 'static,
    F: Future<Output = Result<T, E>> + Send + 'static,
{
    if let Some(known) = cell.get() {
        return Ok((known.clone(), false));
    }
    let found = flights.join(key, compute).await.1?;
    // The first of several concurrent callers fills the cell.
    let is_new = cell.set(found.clone()).is_ok();
    Ok((found, is_new))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gramian_numerics::error::NumericsError;
    use gramian_numerics::observer::Unobserved;
    use gramian_numerics::points::sampling::Scales;

    fn line(n: usize, offset: f64) -> Cloud {
        Cloud::new((0..n).map(|i| i as f64 + offset).collect(), 1).unwrap()
    }

    #[test]
    fn a_cloud_is_registered_once_and_belongs_to_its_owner() {
        let store = CloudStore::<()>::new(1 << 20);
        let (first, is_new) = store.register(Owner(0), line(4, 0.0), None);
        assert!(is_new);
        let (again, is_new) = store.register(Owner(0), line(4, 0.0), None);
        assert!(!is_new && Arc::ptr_eq(&first, &again));
        assert!(store.get(Owner(1), first.id).is_none());
        assert!(store.clouds.remove(Owner(1), &first.id).is_none());
        assert!(store.clouds.remove(Owner(0), &first.id).is_some());
        assert!(store.get(Owner(0), first.id).is_none());
    }

    #[test]
    fn the_least_recently_used_clouds_make_room() {
        // 1,000 points take 8 KB, and less than 1 KB of overhead. The budget holds four such clouds.
        let store = CloudStore::<()>::new(40 << 10);
        let ids: Vec<_> =
            (0..10).map(|k| store.register(Owner(0), line(1000, f64::from(k) / 16.0), None).0.id).collect();
        let kept = store.unstored(Owner(0)).len();
        assert_eq!(kept, 4);
        assert!(store.get(Owner(0), ids[0]).is_none() && store.get(Owner(0), ids[9]).is_some());
    }

    #[tokio::test]
    async fn spacings_and_duplicates_are_counted() {
        let cloud = Cloud::new(vec![0.0, 1.0, 1.0, 5.0], 1).unwrap();
        let store = CloudStore::<NumericsError>::new(1 << 20);
        let (stored, _) = store.register(Owner(0), cloud, None);
        assert!(stored.n_duplicates == 1 && stored.scales().is_none());
        let cloud = stored.cloud.clone();
        let compute = || async move { Sampling::of(&cloud, &Unobserved) };
        store.sampling(Owner(0), &stored, compute).await.unwrap();
        let range = stored.scales().and_then(Scales::nearest_range).unwrap();
        assert_eq!((range.min, range.median, range.max), (1.0, 1.0, 4.0));
        // A known sampling is not computed again.
        let before = store.n_bytes();
        let again = store.sampling(Owner(0), &stored, || async { Err(NumericsError::Cancelled) }).await;
        assert!(again.is_ok() && store.n_bytes() == before && before >= stored.n_bytes());
    }

    #[tokio::test]
    async fn a_cloud_stays_that_fills_the_budget_with_its_sampling() {
        // 8 KB of points, and 18 KB of sampling.
        let store = CloudStore::<NumericsError>::new(12_000);
        let (stored, _) = store.register(Owner(0), line(1000, 0.0), None);
        let cloud = stored.cloud.clone();
        let compute = || async move { Sampling::of(&cloud, &Unobserved) };
        store.sampling(Owner(0), &stored, compute).await.unwrap();
        assert!(stored.n_bytes() > 12_000 && store.get(Owner(0), stored.id).is_some());
        assert!(store.n_bytes() <= 12_000);
    }
}
