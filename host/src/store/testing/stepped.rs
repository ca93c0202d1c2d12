//! A store in memory whose calls stop before they take effect, and before they are answered. A schedule lets
//! them go on.

use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};

use async_trait::async_trait;
use futures_util::stream::{self, BoxStream};
use futures_util::{StreamExt, TryStreamExt};
use object_store::memory::InMemory;
use object_store::path::Path;
use object_store::{
    CopyOptions, Error, GetOptions, GetResult, ListResult, MultipartUpload, ObjectMeta, ObjectStore,
    ObjectStoreExt, PutMultipartOptions, PutOptions, PutPayload, PutResult, Result,
};
use tokio::sync::oneshot;

/// Yields without progress before a run counts as settled: as many as the longest chain of tasks that wake
/// each other within a process.
const HOPS: usize = 8;

/// Kind of a call of the store.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Call {
    Put,
    Get,
    Delete,
    List,
}

/// Places in which calls stop.
#[derive(Debug, Clone, Copy)]
pub struct Stops {
    /// Whether calls of a kind stop at a name or folder. The others pass, in one step with the call before.
    pub at: fn(Call, &Path) -> bool,
    /// Whether calls also stop before they are answered. Where processes share nothing but the store, that
    /// adds no new order of effects.
    pub before_answers: bool,
}

impl Default for Stops {
    fn default() -> Self {
        Self { at: |_, _| true, before_answers: true }
    }
}

/// The parked calls, and the behaviour of the store.
#[derive(Debug, Default)]
pub struct Gate {
    stops: Stops,
    parked: Mutex<Vec<oneshot::Sender<()>>>,
    /// Number of times that a call stopped or went on.
    n_moves: AtomicUsize,
    /// Whether calls pass without a stop.
    is_open: AtomicBool,
    /// Whether calls that change something fail.
    is_broken: AtomicBool,
    /// Whether a deletion reports a missing object. A directory does, a bucket does not.
    tells_absence: AtomicBool,
}

#[derive(Debug, Clone)]
pub struct SteppedStore {
    inner: Arc<InMemory>,
    gate: Arc<Gate>,
}

impl Gate {
    pub fn n_parked(&self) -> usize {
        self.parked().len()
    }

    fn n_moves(&self) -> usize {
        self.n_moves.load(Ordering::Relaxed)
    }

    /// Lets one parked call go on.
    pub fn release(&self, at: usize) {
        let sender = self.parked().remove(at);
        // A dropped call needs no answer.
        sender.send(()).ok();
        self.n_moves.fetch_add(1, Ordering::Relaxed);
    }

    pub fn set_open(&self, is_open: bool) {
        self.is_open.store(is_open, Ordering::Relaxed);
    }

    pub fn set_broken(&self, is_broken: bool) {
        self.is_broken.store(is_broken, Ordering::Relaxed);
    }

    pub fn is_broken(&self) -> bool {
        self.is_broken.load(Ordering::Relaxed)
    }

    fn parked(&self) -> MutexGuard<'_, Vec<oneshot::Sender<()>>> {
        self.parked.lock().unwrap()
    }

    /// Runs all tasks until every call of the store is parked.
    pub async fn settle(&self) {
        let (mut n_idle, mut n_moves) = (0, self.n_moves());
        while n_idle < HOPS {
            tokio::task::yield_now().await;
            n_idle = if self.n_moves() == n_moves { n_idle + 1 } else { 0 };
            n_moves = self.n_moves();
        }
    }

    async fn stop(&self) {
        if self.is_open.load(Ordering::Relaxed) {
            return;
        }
        let (sender, released) = oneshot::channel();
        self.parked().push(sender);
        self.n_moves.fetch_add(1, Ordering::Relaxed);
        released.await.ok();
    }

    async fn change<T>(&self, call: Call, name: &Path, effect: impl Future<Output = Result<T>>) -> Result<T> {
        let effect = async {
            if self.is_broken() {
                return Err(Error::Generic { store: "stepped", source: "it takes nothing".into() });
            }
            effect.await
        };
        self.step(call, name, effect).await
    }

    async fn step<T>(&self, call: Call, name: &Path, effect: impl Future<Output = T>) -> T {
        let stops = (self.stops.at)(call, name);
        if stops {
            self.stop().await;
        }
        let answer = effect.await;
        // A call that passes is progress as well.
        self.n_moves.fetch_add(1, Ordering::Relaxed);
        if stops && self.stops.before_answers {
            self.stop().await;
        }
        answer
    }
}

impl SteppedStore {
    pub fn new(tells_absence: bool, stops: Stops) -> (Self, Arc<Gate>) {
        let gate = Arc::new(Gate { stops, tells_absence: tells_absence.into(), ..Gate::default() });
        (Self { inner: Arc::default(), gate: gate.clone() }, gate)
    }

    /// Names of all objects, found without a stop.
    pub async fn names(&self) -> Vec<String> {
        let found: Vec<_> = self.inner.list(None).try_collect().await.unwrap();
        found.into_iter().map(|object| object.location.to_string()).collect()
    }

    /// Deletes all objects, without a stop.
    pub async fn clear(&self) {
        for name in self.names().await {
            self.inner.delete(&name.into()).await.unwrap();
        }
    }

    async fn delete_one(self, name: Path) -> Result<Path> {
        let effect = async {
            let was_there = self.inner.head(&name).await.is_ok();
            self.inner.delete(&name).await?;
            if was_there || !self.gate.tells_absence.load(Ordering::Relaxed) {
                Ok(name.clone())
            } else {
                Err(Error::NotFound { path: name.to_string(), source: "absent".into() })
            }
        };
        self.gate.change(Call::Delete, &name, effect).await
    }
}

impl fmt::Display for SteppedStore {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("stepped")
    }
}

#[async_trait]
impl ObjectStore for SteppedStore {
    async fn put_opts(&self, name: &Path, payload: PutPayload, options: PutOptions) -> Result<PutResult> {
        self.gate.change(Call::Put, name, self.inner.put_opts(name, payload, options)).await
    }

    async fn put_multipart_opts(
        &self,
        name: &Path,
        options: PutMultipartOptions,
    ) -> Result<Box<dyn MultipartUpload>> {
        self.inner.put_multipart_opts(name, options).await
    }

    async fn get_opts(&self, name: &Path, options: GetOptions) -> Result<GetResult> {
        self.gate.step(Call::Get, name, self.inner.get_opts(name, options)).await
    }

    fn delete_stream(&self, names: BoxStream<'static, Result<Path>>) -> BoxStream<'static, Result<Path>> {
        let store = self.clone();
        names.then(move |name| store.clone().delete_one(name.unwrap())).boxed()
    }

    fn list(&self, folder: Option<&Path>) -> BoxStream<'static, Result<ObjectMeta>> {
        let (store, folder) = (self.clone(), folder.cloned());
        let listing = async move {
            let found = async { store.inner.list(folder.as_ref()).collect::<Vec<_>>().await };
            stream::iter(store.gate.step(Call::List, &folder.clone().unwrap_or_default(), found).await)
        };
        stream::once(listing).flatten().boxed()
    }

    async fn list_with_delimiter(&self, folder: Option<&Path>) -> Result<ListResult> {
        let name = folder.cloned().unwrap_or_default();
        self.gate.step(Call::List, &name, self.inner.list_with_delimiter(folder)).await
    }

    async fn copy_opts(&self, from: &Path, to: &Path, options: CopyOptions) -> Result<()> {
        self.gate.change(Call::Put, to, self.inner.copy_opts(from, to, options)).await
    }
}
