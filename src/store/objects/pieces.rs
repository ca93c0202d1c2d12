//! Objects that are written and read piece by piece: a line of JSON, a body, and the BLAKE3 of both, 32 bytes.
//!
//! WRITES are whole or not at all. READS end with the hash: who reads a body that is not what was written finds it broken off, and never whole.

use std::time::SystemTime;

use bytes::{Bytes, BytesMut};
use futures_util::stream::BoxStream;
use futures_util::{Stream, StreamExt, TryStreamExt};
use object_store::path::Path;
use object_store::{Error, ObjectStoreExt, PutPayload, WriteMultipart};

use super::{Damaged, Objects, Unavailable, Verb};

/// Bytes of the hash behind everything.
pub const HASH_BYTES: usize = 32;

/// Bytes that a first line may have.
pub(super) const MAX_LINE: usize = 64 << 10;

/// What has no more bytes is written at once, all else in parts.
const AT_ONCE: usize = 8 << 20;

/// Parts that are on their way at once.
const PARTS_UNDER_WAY: usize = 4;

/// An object that is there, as far as its first line.
pub struct Found {
    pub line: Bytes,
    pub written_at: SystemTime,
    pub n_body_bytes: u64,
    pub body: BoxStream<'static, Result<Bytes, BrokenOff>>,
}

/// Why a body ends before its end.
#[derive(Debug, Clone, thiserror::Error)]
pub enum BrokenOff {
    #[error("the store does not go on: {0}")]
    Store(String),
    #[error("its bytes are not those that were written")]
    Damaged,
}

impl Objects {
    /// Writes an object; says how many bytes it has. If the process ends meanwhile, a directory keeps what there is under another name until the
    /// next sweep, and a bucket as parts of an upload that was not completed.
    ///
    /// # Errors
    /// [`Unavailable`], also if the pieces break off.
    pub(super) async fn put_pieces(
        &self,
        name: &Path,
        line: Bytes,
        pieces: impl Stream<Item = Result<Bytes, String>>,
    ) -> Result<u64, Unavailable> {
        let mut parts = None;
        let sent = self.send(name, line, pieces, &mut parts).await;
        let written = match (sent, parts) {
            (Ok((n_bytes, held)), None) => {
                let written = self.store.put(name, held.into_iter().collect()).await;
                written.map(|_| n_bytes).map_err(|error| error.to_string())
            }
            (Ok((n_bytes, _)), Some(parts)) => {
                parts.finish().await.map(|_| n_bytes).map_err(|error| error.to_string())
            }
            (Err(reason), parts) => {
                if let Some(parts) = parts {
                    // What was begun takes room in the store.
                    let _ = parts.abort().await;
                }
                Err(reason)
            }
        };
        self.tally.add(Verb::Write, written.is_ok());
        written.map_err(|reason| Unavailable { verb: Verb::Write, name: name.to_string(), reason })
    }

    /// Sends what is more than is written at once, in parts; says how many bytes there are, and those that were held back.
    async fn send(
        &self,
        name: &Path,
        line: Bytes,
        pieces: impl Stream<Item = Result<Bytes, String>>,
        parts: &mut Option<WriteMultipart>,
    ) -> Result<(u64, Vec<Bytes>), String> {
        let failed = |error: Error| error.to_string();
        let (mut hasher, mut held, mut n_bytes) = (blake3::Hasher::new(), Vec::new(), 0);
        let line = futures_util::stream::once(std::future::ready(Ok(line)));
        let mut pieces = std::pin::pin!(line.chain(pieces));
        loop {
            let (piece, is_last) = match pieces.next().await {
                Some(piece) => (piece?, false),
                None => (Bytes::copy_from_slice(hasher.finalize().as_bytes()), true),
            };
            hasher.update(&piece);
            n_bytes += piece.len();
            held.push(piece);
            if n_bytes > AT_ONCE && parts.is_none() {
                *parts = Some(WriteMultipart::new(self.store.put_multipart(name).await.map_err(failed)?));
            }
            if let Some(parts) = parts {
                for piece in held.drain(..) {
                    parts.wait_for_capacity(PARTS_UNDER_WAY).await.map_err(failed)?;
                    parts.put(piece);
                }
            }
            if is_last {
                return Ok((n_bytes as u64, held));
            }
            // However fast the store is, others have their turn.
            tokio::task::yield_now().await;
        }
    }

    /// Opens an object that was written in pieces.
    ///
    /// # Errors
    /// [`Unavailable`]. [`Damaged`] if it has no first line.
    pub(super) async fn open_pieces(
        &self,
        name: &Path,
    ) -> Result<Option<Result<Found, Damaged>>, Unavailable> {
        let found = self.counted(Verb::Read, name, self.store.get(name).await)?;
        let Some(found) = found else { return Ok(None) };
        let (n_bytes, written_at) = (found.meta.size, SystemTime::from(found.meta.last_modified));
        let mut bytes = found.into_stream();
        let mut first = BytesMut::new();
        let end = loop {
            if let Some(end) = first.iter().position(|&byte| byte == b'\n') {
                break end + 1;
            }
            match bytes.try_next().await.map_err(|error| self.failed(Verb::Read, name, error))? {
                Some(more) if first.len() <= MAX_LINE => first.extend_from_slice(&more),
                _ => return Ok(Some(Err(Damaged("it has no first line")))),
            }
        };
        let line = first.split_to(end).freeze();
        let n_body_bytes = n_bytes.saturating_sub((line.len() + HASH_BYTES) as u64);
        let mut hasher = blake3::Hasher::new();
        hasher.update(&line);
        let rest = bytes.map_err(|error| BrokenOff::Store(error.to_string())).boxed();
        let body = checked(hasher, first.freeze(), rest).boxed();
        Ok(Some(Ok(Found { line, written_at, n_body_bytes, body })))
    }
}

/// A short object as it is written: a line and its hash.
pub(super) fn sealed(line: Bytes) -> PutPayload {
    let hash = Bytes::copy_from_slice(blake3::hash(&line).as_bytes());
    [line, hash].into_iter().collect()
}

/// The line of a short object.
///
/// # Errors
/// [`Damaged`] unless it is as it was written.
pub(super) fn unsealed(bytes: &[u8]) -> Result<&[u8], Damaged> {
    let end = bytes.len().checked_sub(HASH_BYTES).ok_or(Damaged("it ends too early"))?;
    let (line, hash) = bytes.split_at(end);
    let is_whole = blake3::hash(line).as_bytes() == hash;
    if is_whole { Ok(line) } else { Err(Damaged("its bytes are not those that were written")) }
}

/// The body in front of the hash behind it. Its last bytes come only once the hash is right.
fn checked(
    hasher: blake3::Hasher,
    first: Bytes,
    rest: BoxStream<'static, Result<Bytes, BrokenOff>>,
) -> impl Stream<Item = Result<Bytes, BrokenOff>> {
    let first = futures_util::stream::once(std::future::ready(Ok(first)));
    let state = Some((hasher, BytesMut::new(), first.chain(rest).boxed()));
    futures_util::stream::unfold(state, |state| async move {
        let (mut hasher, mut held, mut bytes) = state?;
        loop {
            match bytes.next().await {
                Some(Err(error)) => return Some((Err(error), None)),
                Some(Ok(more)) => {
                    held.extend_from_slice(&more);
                    // A byte of the body is held back as well, so that there is something to break off.
                    let n_free = held.len().saturating_sub(HASH_BYTES + 1);
                    if n_free > 0 {
                        let free = held.split_to(n_free).freeze();
                        hasher.update(&free);
                        return Some((Ok(free), Some((hasher, held, bytes))));
                    }
                }
                None => {
                    let body = held.split_to(held.len().saturating_sub(HASH_BYTES)).freeze();
                    hasher.update(&body);
                    let is_whole = hasher.finalize().as_bytes()[..] == held[..];
                    return Some((if is_whole { Ok(body) } else { Err(BrokenOff::Damaged) }, None));
                }
            }
        }
    })
}
