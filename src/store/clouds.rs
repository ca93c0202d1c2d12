//! Registered clouds, named by their content.

use std::convert::Infallible;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, SystemTime};

use super::Owner;
use super::fair_cache::{Counts, FairCache};
use super::key::CloudId;
use super::objects::cloud_object::CloudHead;
use super::single_flight::SingleFlight;
use crate::numerics::machine::heap::{arc_payload, block_bytes, vec_bytes};
use crate::numerics::points::cloud::Cloud;
use crate::numerics::points::duplicates::count_duplicates;
use crate::numerics::points::sampling::{Sampling, Scales};

/// A cloud with what its positions say, once that was asked for.
///
/// The cells are only ever read and set: what they hold is computed elsewhere, by [`CloudStore::sampling`] and
/// [`CloudStore::noise`].
pub struct RegisteredCloud {
    pub id: CloudId,
    pub cloud: Arc<Cloud>,
    /// The client's normals, `[n, d]`, not normalised.
    pub normals: Option<Cloud>,
    /// Nanoseconds since 1970.
    created_at: AtomicU64,
    /// Whether it outlives the process.
    is_durable: AtomicBool,
    /// Whether the store has not taken it, so that memory must keep it.
    is_pending: AtomicBool,
    /// Whether it was deleted.
    is_forgotten: AtomicBool,
    /// When it was last seen in the store, nanoseconds since 1970.
    seen_at: AtomicU64,
    /// Points that coincide with an earlier one.
    pub n_duplicates: usize,
    /// The least and the greatest value of each coordinate.
    pub bounding_box: (Vec<f64>, Vec<f64>),
    sampling: OnceLock<Arc<Sampling>>,
    noise: OnceLock<f64>,
}

impl RegisteredCloud {
    fn new(id: CloudId, cloud: Cloud, normals: Option<Cloud>) -> Self {
        // What is kept comes first, what is needed for a moment behind it.
        let (cloud, normals) = (Arc::new(cloud.compact()), normals.map(Cloud::compact));
        Self {
            id,
            n_duplicates: count_duplicates(&cloud),
            bounding_box: cloud.bounding_box(),
            cloud,
            normals,
            created_at: AtomicU64::new(nanoseconds(SystemTime::now())),
            is_durable: AtomicBool::new(false),
            is_pending: AtomicBool::new(false),
            is_forgotten: AtomicBool::new(false),
            seen_at: AtomicU64::new(0),
            sampling: OnceLock::new(),
            noise: OnceLock::new(),
        }
    }

    /// As it was written, with the name that its points have.
    pub fn restored(id: CloudId, cloud: Cloud, normals: Option<Cloud>, head: CloudHead) -> Self {
        let (cloud, normals) = (Arc::new(cloud.compact()), normals.map(Cloud::compact));
        Self {
            id,
            n_duplicates: head.n_duplicates,
            bounding_box: head.bounding_box,
            cloud,
            normals,
            created_at: AtomicU64::new(nanoseconds(head.created_at)),
            is_durable: AtomicBool::new(true),
            is_pending: AtomicBool::new(false),
            is_forgotten: AtomicBool::new(false),
            seen_at: AtomicU64::new(nanoseconds(SystemTime::now())),
            sampling: OnceLock::new(),
            noise: OnceLock::new(),
        }
    }

    /// When it was registered.
    pub fn created_at(&self) -> SystemTime {
        SystemTime::UNIX_EPOCH + Duration::from_nanos(self.created_at.load(Ordering::Relaxed))
    }

    /// Whether it outlives the process.
    pub fn is_durable(&self) -> bool {
        self.is_durable.load(Ordering::Acquire)
    }

    /// Says that it does, and since when it is registered if it was before.
    pub fn set_durable(&self, since: Option<SystemTime>) {
        if let Some(since) = since {
            self.created_at.store(nanoseconds(since), Ordering::Relaxed);
        }
        self.trust();
        self.is_durable.store(true, Ordering::Release);
        self.is_pending.store(false, Ordering::Release);
    }

    /// Says that the store has not taken it: memory keeps it until then, if it does.
    fn set_pending(&self) {
        self.is_pending.store(true, Ordering::Release);
    }

    /// Whether it was deleted: then it must not be written any more.
    pub fn is_forgotten(&self) -> bool {
        self.is_forgotten.load(Ordering::Acquire)
    }

    /// Says that it is deleted, or that it could not be.
    pub fn set_forgotten(&self, is_forgotten: bool) {
        self.is_forgotten.store(is_forgotten, Ordering::Release);
    }

    /// It was seen in the store.
    pub fn trust(&self) {
        self.seen_at.store(nanoseconds(SystemTime::now()), Ordering::Relaxed);
    }

    /// Whether it is in memory alone, or was in the store no longer than that ago.
    pub fn is_trusted(&self, most: Duration) -> bool {
        let elapsed = nanoseconds(SystemTime::now()).saturating_sub(self.seen_at.load(Ordering::Relaxed));
        !self.is_durable() || Duration::from_nanos(elapsed) <= most
    }

    /// How it is sampled, once that was asked for.
    pub fn sampling(&self) -> Option<&Arc<Sampling>> {
        self.sampling.get()
    }

    /// The lengths that kernels are chosen by, likewise.
    pub fn scales(&self) -> Option<&Scales> {
        self.sampling().map(|sampling| sampling.scales())
    }

    /// Standard deviation of the points across the surface that they sample, unit L, once it was asked for.
    pub fn noise(&self) -> Option<f64> {
        self.noise.get().copied()
    }

    /// Bytes held on the heap.
    pub fn n_bytes(&self) -> usize {
        let own = block_bytes(arc_payload::<Self>()) + block_bytes(arc_payload::<Cloud>());
        let (min, max) = &self.bounding_box;
        let bounding_box = vec_bytes(min) + vec_bytes(max);
        let sampling = self.sampling().map_or(0, |s| block_bytes(arc_payload::<Sampling>()) + s.n_bytes());
        own + bounding_box + sampling + self.cloud.n_bytes() + self.normals.as_ref().map_or(0, Cloud::n_bytes)
    }
}

/// Since 1970; until 2554.
fn nanoseconds(time: SystemTime) -> u64 {
    let since_epoch = time.duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since_epoch.as_nanos()).unwrap_or(u64::MAX)
}

/// The clouds of all owners within one byte budget. `E` is what a computation may fail with.
pub struct CloudStore<E> {
    clouds: FairCache<CloudId, Arc<RegisteredCloud>>,
    samplings: SingleFlight<(Owner, CloudId), Arc<Sampling>, E>,
    noise: SingleFlight<(Owner, CloudId), f64, E>,
    reads: SingleFlight<(Owner, CloudId), Option<Arc<RegisteredCloud>>, E>,
    writes: SingleFlight<(Owner, CloudId), Option<bool>, Infallible>,
}

impl<E: Clone + Send + Sync + 'static> CloudStore<E> {
    pub fn new(max_bytes: usize) -> Self {
        Self {
            clouds: FairCache::sparing(max_bytes, |cloud| cloud.is_pending.load(Ordering::Acquire)),
            samplings: SingleFlight::new(),
            noise: SingleFlight::new(),
            reads: SingleFlight::new(),
            writes: SingleFlight::new(),
        }
    }

    /// Registers a cloud, or finds it; says whether it is new. A cloud beyond the whole budget is answered, not kept.
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

    /// The cloud that is kept, or what `read` finds, at most once however many ask.
    ///
    /// # Errors
    /// Those of `read`; they are not kept.
    pub async fn get_or_read<F>(
        &self,
        owner: Owner,
        id: CloudId,
        read: impl FnOnce() -> F,
    ) -> Result<Option<Arc<RegisteredCloud>>, E>
    where
        F: Future<Output = Result<Option<Arc<RegisteredCloud>>, E>> + Send + 'static,
    {
        match self.clouds.get(owner, &id) {
            Some(found) => Ok(Some(found)),
            None => self.reads.join((owner, id), read).await.1,
        }
    }

    /// Writes a cloud at most once however many have it; answers what `write` does.
    pub async fn write<F>(&self, owner: Owner, id: CloudId, write: impl FnOnce() -> F) -> Option<bool>
    where
        F: Future<Output = Option<bool>> + Send + 'static,
    {
        let begin = || {
            let writing = write();
            async move { Ok(writing.await) }
        };
        self.writes.join((owner, id), begin).await.1.unwrap_or_else(|never: Infallible| match never {})
    }

    /// Keeps a cloud until the store takes it; says whether it is kept.
    pub fn hold(&self, owner: Owner, cloud: &Arc<RegisteredCloud>) -> bool {
        // First: what is found below is not let go any more.
        cloud.set_pending();
        self.has(owner, cloud)
    }

    /// Whether it is this one that is kept.
    pub fn has(&self, owner: Owner, cloud: &Arc<RegisteredCloud>) -> bool {
        self.clouds.get(owner, &cloud.id).is_some_and(|kept| Arc::ptr_eq(&kept, cloud))
    }

    /// Keeps a cloud that was read again, unless it is there.
    pub fn adopt(&self, owner: Owner, cloud: RegisteredCloud) -> Arc<RegisteredCloud> {
        let (id, cloud) = (cloud.id, Arc::new(cloud));
        self.clouds.get_or_insert(owner, id, cloud, |cloud| cloud.n_bytes()).0
    }

    pub fn get(&self, owner: Owner, id: CloudId) -> Option<Arc<RegisteredCloud>> {
        self.clouds.get(owner, &id)
    }

    /// How the cloud is sampled, which `compute` finds at most once however many ask.
    ///
    /// # Errors
    /// Those of `compute`; they are not kept.
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
            // A cloud that was kept stays, with the weight that it had where its sampling has no room beside it.
            self.clouds.reweigh(owner, stored.id, stored.n_bytes());
        }
        Ok(sampling)
    }

    /// Sees to it that the noise of the cloud is known, as [`CloudStore::sampling`] does.
    ///
    /// # Errors
    /// Those of `compute`; they are not kept.
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

    /// Forgets a cloud; says whether it was there.
    pub fn remove(&self, owner: Owner, id: CloudId) -> bool {
        self.clouds.remove(owner, &id)
    }

    /// Bytes of all clouds that are kept.
    pub fn n_bytes(&self) -> usize {
        self.clouds.n_bytes()
    }

    /// How many are kept, and how many made room for others.
    pub fn counts(&self) -> Counts {
        self.clouds.counts()
    }

    /// All clouds of an owner, oldest first, ties by id.
    pub fn list(&self, owner: Owner) -> Vec<Arc<RegisteredCloud>> {
        let mut clouds = self.clouds.values(owner);
        clouds.sort_by_key(|stored| (stored.created_at(), stored.id));
        clouds
    }
}

/// What is in a cell, or what a flight brings, which is put in; and whether this one put it in.
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
    // Of many who bring the same, the first one puts it in.
    let is_new = cell.set(found.clone()).is_ok();
    Ok((found, is_new))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::error::NumericsError;
    use crate::numerics::observer::Unobserved;

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
        assert!(!store.remove(Owner(1), first.id) && store.remove(Owner(0), first.id));
        assert!(store.get(Owner(0), first.id).is_none());
    }

    #[test]
    fn the_least_recently_used_clouds_make_room() {
        // 1,000 points weigh 8 KB and less than one beside; the budget holds four of them.
        let store = CloudStore::<()>::new(40 << 10);
        let ids: Vec<_> =
            (0..10).map(|k| store.register(Owner(0), line(1000, f64::from(k) / 16.0), None).0.id).collect();
        let kept = store.list(Owner(0)).len();
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
        // What is known is not computed again.
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
