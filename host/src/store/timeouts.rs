//! A store whose calls time out. Clients of buckets retry for minutes. A caller would hold its place and
//! memory for as long, until nobody else has any, although memory could answer.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use bytes::Bytes;
use futures_util::StreamExt;
use futures_util::stream::{self, BoxStream};
use object_store::path::Path;
use object_store::{
    CopyOptions, Error, GetOptions, GetResult, GetResultPayload, ListResult, MultipartUpload, ObjectMeta,
    ObjectStore, PutMultipartOptions, PutOptions, PutPayload, PutResult, RenameOptions, Result, UploadPart,
};

/// Most time for an answer without bytes, and for each next piece of an answer with bytes.
const ANSWERING: Duration = Duration::from_secs(5);

/// Least rate at which a store must take bytes beyond [`ANSWERING`].
const BYTES_PER_SECOND: f64 = (4 << 20) as f64;

/// A store whose slow calls fail.
#[derive(Debug, Clone)]
pub(super) struct WithTimeouts {
    inner: Arc<dyn ObjectStore>,
    timeouts: Timeouts,
}

/// Time limits of calls.
#[derive(Debug, Clone, Copy)]
struct Timeouts {
    answering: Duration,
}

impl Timeouts {
    /// Returns the result of a call, or an error if it takes longer than allowed for `n_bytes`.
    async fn wait<T>(self, n_bytes: usize, call: impl Future<Output = Result<T>>) -> Result<T> {
        let most = self.answering + Duration::from_secs_f64(n_bytes as f64 / BYTES_PER_SECOND);
        tokio::time::timeout(most, call).await.unwrap_or_else(|_| Err(late(most)))
    }

    /// Streams items, each of which must arrive in time. A late item becomes an error that ends the stream.
    fn each<T: 'static + Send>(self, items: BoxStream<'static, Result<T>>) -> BoxStream<'static, Result<T>> {
        let next = move |items: Option<BoxStream<'static, Result<T>>>| async move {
            let mut items = items?;
            match tokio::time::timeout(self.answering, items.next()).await {
                Ok(item) => Some((item?, Some(items))),
                Err(_) => Some((Err(late(self.answering)), None)),
            }
        };
        stream::unfold(Some(items), next).boxed()
    }
}

fn late(most: Duration) -> Error {
    let reason = format!("no answer within {:.0} s", most.as_secs_f64().ceil());
    Error::Generic { store: "store", source: reason.into() }
}

impl WithTimeouts {
    pub(super) fn new(inner: Arc<dyn ObjectStore>) -> Self {
        Self { inner, timeouts: Timeouts { answering: ANSWERING } }
    }
}

impl fmt::Display for WithTimeouts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.inner.fmt(f)
    }
}

// Every method is forwarded. A default one would do something else than the inner store, such as copy instead
// of rename.
#[async_trait]
#[deny(clippy::missing_trait_methods)]
impl ObjectStore for WithTimeouts {
    async fn put_opts(&self, name: &Path, payload: PutPayload, options: PutOptions) -> Result<PutResult> {
        self.timeouts.wait(payload.content_length(), self.inner.put_opts(name, payload, options)).await
    }

    async fn put_multipart_opts(
        &self,
        name: &Path,
        options: PutMultipartOptions,
    ) -> Result<Box<dyn MultipartUpload>> {
        let inner = self.timeouts.wait(0, self.inner.put_multipart_opts(name, options)).await?;
        Ok(Box::new(UploadWithTimeouts { inner, timeouts: self.timeouts, n_bytes: 0 }))
    }

    async fn get_opts(&self, name: &Path, options: GetOptions) -> Result<GetResult> {
        let mut found = self.timeouts.wait(0, self.inner.get_opts(name, options)).await?;
        if let GetResultPayload::Stream(pieces) = found.payload {
            found.payload = GetResultPayload::Stream(self.timeouts.each(pieces));
        }
        Ok(found)
    }

    async fn get_ranges(&self, name: &Path, ranges: &[Range<u64>]) -> Result<Vec<Bytes>> {
        let n_bytes = ranges.iter().map(|range| range.end.saturating_sub(range.start)).sum::<u64>();
        let n_bytes = usize::try_from(n_bytes).unwrap_or(usize::MAX);
        self.timeouts.wait(n_bytes, self.inner.get_ranges(name, ranges)).await
    }

    fn delete_stream(&self, names: BoxStream<'static, Result<Path>>) -> BoxStream<'static, Result<Path>> {
        self.timeouts.each(self.inner.delete_stream(names))
    }

    fn list(&self, folder: Option<&Path>) -> BoxStream<'static, Result<ObjectMeta>> {
        self.timeouts.each(self.inner.list(folder))
    }

    fn list_with_offset(
        &self,
        folder: Option<&Path>,
        offset: &Path,
    ) -> BoxStream<'static, Result<ObjectMeta>> {
        self.timeouts.each(self.inner.list_with_offset(folder, offset))
    }

    async fn list_with_delimiter(&self, folder: Option<&Path>) -> Result<ListResult> {
        self.timeouts.wait(0, self.inner.list_with_delimiter(folder)).await
    }

    async fn copy_opts(&self, from: &Path, to: &Path, options: CopyOptions) -> Result<()> {
        self.timeouts.wait(0, self.inner.copy_opts(from, to, options)).await
    }

    async fn rename_opts(&self, from: &Path, to: &Path, options: RenameOptions) -> Result<()> {
        self.timeouts.wait(0, self.inner.rename_opts(from, to, options)).await
    }
}

/// An upload in parts.
#[derive(Debug)]
struct UploadWithTimeouts {
    inner: Box<dyn MultipartUpload>,
    timeouts: Timeouts,
    n_bytes: usize,
}

#[async_trait]
impl MultipartUpload for UploadWithTimeouts {
    fn put_part(&mut self, payload: PutPayload) -> UploadPart {
        let n_bytes = payload.content_length();
        self.n_bytes += n_bytes;
        let (timeouts, part) = (self.timeouts, self.inner.put_part(payload));
        Box::pin(timeouts.wait(n_bytes, part))
    }

    /// Waits for all bytes of the upload, because a directory only now writes them to the disk.
    async fn complete(&mut self) -> Result<PutResult> {
        self.timeouts.wait(self.n_bytes, self.inner.complete()).await
    }

    async fn abort(&mut self) -> Result<()> {
        self.timeouts.wait(0, self.inner.abort()).await
    }
}

#[cfg(test)]
mod tests {
    use futures_util::TryStreamExt;
    use object_store::ObjectStoreExt;
    use object_store::memory::InMemory;
    use object_store::throttle::{ThrottleConfig, ThrottledStore};

    use super::*;

    const NEVER: Duration = Duration::from_secs(1 << 20);

    fn patient(config: ThrottleConfig) -> WithTimeouts {
        let store = ThrottledStore::new(InMemory::new(), config);
        WithTimeouts { inner: Arc::new(store), timeouts: Timeouts { answering: Duration::from_millis(1) } }
    }

    #[tokio::test]
    async fn every_call_has_an_end() {
        let store = patient(ThrottleConfig {
            wait_delete_per_call: NEVER,
            wait_get_per_call: NEVER,
            wait_list_per_call: NEVER,
            wait_list_with_delimiter_per_call: NEVER,
            wait_put_per_call: NEVER,
            ..ThrottleConfig::default()
        });
        let name = Path::from("name");
        let failures = [
            store.put(&name, "text".into()).await.err(),
            store.get(&name).await.err(),
            store.head(&name).await.err(),
            store.delete(&name).await.err(),
            store.rename(&name, &Path::from("other")).await.err(),
            store.list(None).try_collect::<Vec<_>>().await.err(),
            store.list_with_offset(None, &name).try_collect::<Vec<_>>().await.err(),
            store.list_with_delimiter(None).await.err(),
        ];
        for (call, failure) in failures.into_iter().enumerate() {
            assert!(failure.is_some_and(|error| error.to_string().contains("no answer within")), "{call}");
        }
    }

    #[tokio::test]
    async fn pieces_that_stay_away_end_an_answer_and_an_upload() {
        let store = patient(ThrottleConfig { wait_get_per_byte: NEVER, ..ThrottleConfig::default() });
        let name = Path::from("name");
        store.put(&name, "text".into()).await.unwrap();
        assert!(store.get(&name).await.unwrap().bytes().await.is_err());
        let store = patient(ThrottleConfig { wait_put_per_call: NEVER, ..ThrottleConfig::default() });
        let is_late = match store.put_multipart(&name).await {
            Ok(mut upload) => upload.put_part("text".into()).await.is_err(),
            Err(_) => true,
        };
        assert!(is_late);
    }

    #[tokio::test]
    async fn what_answers_is_as_it_is() {
        let store = WithTimeouts::new(Arc::new(InMemory::new()));
        let name = Path::from("name");
        let mut upload = store.put_multipart(&name).await.unwrap();
        upload.put_part("te".into()).await.unwrap();
        upload.put_part("xt".into()).await.unwrap();
        upload.complete().await.unwrap();
        assert_eq!(store.get(&name).await.unwrap().bytes().await.unwrap(), "text");
        assert_eq!(store.list(None).try_collect::<Vec<_>>().await.unwrap().len(), 1);
        store.delete(&name).await.unwrap();
        assert!(matches!(store.head(&name).await, Err(Error::NotFound { .. })));
    }
}
