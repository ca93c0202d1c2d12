//! A store in memory whose calls stop twice: before they take effect and before they are answered. A schedule
//! lets them go on.

use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};

use async_trait::async_trait;
use futures_util::StreamExt;
use futures_util::stream::{self, BoxStream};
use object_store::memory::InMemory;
use object_store::path::Path;
use object_store::{
    CopyOptions, Error, GetOptions, GetResult, ListResult, MultipartUpload, ObjectMeta, ObjectStore,
    ObjectStoreExt, PutMultipartOptions, PutOptions, PutPayload, PutResult, Result,
};
use tokio::sync::oneshot;

/// The parked calls, and the behaviour of the store.
#[derive(Debug, Default)]
pub struct Gate {
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
pub struct Stepped {
    inner: Arc<InMemory>,
    gate: Arc<Gate>,
}

impl Gate {
    pub fn n_parked(&self) -> usize {
        self.parked().len()
    }

    pub fn n_moves(&self) -> usize {
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

    async fn pass(&self) {
        if self.is_open.load(Ordering::Relaxed) {
            return;
        }
        let (sender, released) = oneshot::channel();
        self.parked().push(sender);
        self.n_moves.fetch_add(1, Ordering::Relaxed);
        released.await.ok();
    }

    async fn change<T>(&self, effect: impl Future<Output = Result<T>>) -> Result<T> {
        self.pass().await;
        if self.is_broken() {
            return Err(Error::Generic { store: "stepped", source: "it takes nothing".into() });
        }
        let answer = effect.await;
        self.pass().await;
        answer
    }

    async fn look<T>(&self, effect: impl Future<Output = T>) -> T {
        self.pass().await;
        let answer = effect.await;
        self.pass().await;
        answer
    }
}

impl Stepped {
    pub fn new(tells_absence: bool) -> (Self, Arc<Gate>) {
        let gate = Arc::new(Gate { tells_absence: tells_absence.into(), ..Gate::default() });
        (Self { inner: Arc::default(), gate: gate.clone() }, gate)
    }

    pub fn objects(&self) -> &InMemory {
        &self.inner
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
        self.gate.change(effect).await
    }
}

impl fmt::Display for Stepped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("stepped")
    }
}

#[async_trait]
impl ObjectStore for Stepped {
    async fn put_opts(&self, name: &Path, payload: PutPayload, options: PutOptions) -> Result<PutResult> {
        self.gate.change(self.inner.put_opts(name, payload, options)).await
    }

    async fn put_multipart_opts(
        &self,
        name: &Path,
        options: PutMultipartOptions,
    ) -> Result<Box<dyn MultipartUpload>> {
        self.inner.put_multipart_opts(name, options).await
    }

    async fn get_opts(&self, name: &Path, options: GetOptions) -> Result<GetResult> {
        self.gate.look(self.inner.get_opts(name, options)).await
    }

    fn delete_stream(&self, names: BoxStream<'static, Result<Path>>) -> BoxStream<'static, Result<Path>> {
        let store = self.clone();
        names.then(move |name| store.clone().delete_one(name.unwrap())).boxed()
    }

    fn list(&self, folder: Option<&Path>) -> BoxStream<'static, Result<ObjectMeta>> {
        let (store, folder) = (self.clone(), folder.cloned());
        let listing = async move {
            let found = async { store.inner.list(folder.as_ref()).collect::<Vec<_>>().await };
            stream::iter(store.gate.look(found).await)
        };
        stream::once(listing).flatten().boxed()
    }

    async fn list_with_delimiter(&self, folder: Option<&Path>) -> Result<ListResult> {
        self.gate.look(self.inner.list_with_delimiter(folder)).await
    }

    async fn copy_opts(&self, from: &Path, to: &Path, options: CopyOptions) -> Result<()> {
        self.gate.change(self.inner.copy_opts(from, to, options)).await
    }
}
