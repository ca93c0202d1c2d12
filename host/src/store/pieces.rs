//! Objects written and read piece by piece: a line of JSON, a body, and the BLAKE3 of both, 32 bytes.
//!
//! WRITES are atomic. READS end with a check of the hash: a damaged body breaks off and never appears
//! complete.
//!
//! READERS get slices of what the store returns, without copies. In memory these are slices of the object
//! itself, which hold its [`Room`]. So a result is in memory once, however many clients read it. Its bytes
//! stay reserved while it is read, even after its deletion.

use std::collections::VecDeque;
use std::time::SystemTime;

use bytes::{Bytes, BytesMut};
use futures_util::stream::BoxStream;
use futures_util::{Stream, StreamExt, TryStreamExt};
use object_store::path::Path;
use object_store::{Error, ObjectStoreExt, PutPayload, WriteMultipart};

use super::room::Room;
use super::{DamagedObject, Objects, Unavailable, Verb};

/// Bytes of the hash at the end of an object.
pub const HASH_BYTES: usize = 32;

/// Most bytes of a first line.
pub(super) const MAX_LINE: usize = 64 << 10;

/// Objects up to this many bytes are written at once, larger ones in parts.
const AT_ONCE: usize = 8 << 20;

/// Number of parts under way at once.
const PARTS_UNDER_WAY: usize = 4;

/// Bytes handed to a reader at a time: some 50 µs of hashing.
const PIECE: usize = 64 << 10;

/// Bytes of an object that one reader may hold: pieces in the buffers of its connection, and one on its way
/// from the store. The client of a bucket reads ahead, in two pieces of up to 408 KiB.
const BYTES_PER_READER: usize = 256 << 10;
const BYTES_PER_READER_OF_BUCKET: usize = 1 << 20;

/// An object in the store, read as far as its first line.
pub struct OpenObject {
    pub line: Bytes,
    pub written_at: SystemTime,
    pub n_body_bytes: u64,
    pub body: BoxStream<'static, Result<Bytes, BrokenOff>>,
}

/// Reason why a body breaks off.
#[derive(Debug, Clone, thiserror::Error)]
pub enum BrokenOff {
    #[error("reading from the store failed: {0}")]
    Store(String),
    #[error("its checksum does not match")]
    Damaged,
}

impl Objects {
    /// Most bytes of an object that one reader holds, however long it reads nothing.
    pub fn bytes_per_reader(&self) -> usize {
        let is_bucket = self.directory.is_none() && !self.in_memory;
        if is_bucket { BYTES_PER_READER_OF_BUCKET } else { BYTES_PER_READER }
    }

    /// Writes an object within its room. Returns its size in bytes.
    ///
    /// If the process ends meanwhile, a directory keeps the written part under another name until the next
    /// sweep. A bucket keeps it as parts of an incomplete upload.
    ///
    /// # Errors
    /// [`Unavailable`], also if the pieces break off or exceed the room. [`Room::is_exceeded`] tells the
    /// latter.
    pub async fn put_pieces(
        &self,
        name: &Path,
        line: Bytes,
        pieces: impl Stream<Item = Result<Bytes, String>>,
        room: &mut Room,
    ) -> Result<u64, Unavailable> {
        let mut parts = None;
        let sent = self.send(name, line, Pieces { pieces, room }, &mut parts).await;
        let written = match (sent, parts) {
            (Ok((n_bytes, held)), None) => {
                let payload = if self.in_memory { room.sealed(held) } else { held.into_iter().collect() };
                let written = self.store.put(name, payload).await;
                written.map(|_| n_bytes).map_err(|error| error.to_string())
            }
            (Ok((n_bytes, _)), Some(parts)) => {
                parts.finish().await.map(|_| n_bytes).map_err(|error| error.to_string())
            }
            (Err(reason), parts) => {
                if let Some(parts) = parts {
                    // An incomplete upload takes room in the store.
                    let _ = parts.abort().await;
                }
                Err(reason)
            }
        };
        if !room.is_exceeded() {
            self.tally.add(Verb::Write, written.is_ok());
        }
        written.map_err(|reason| Unavailable { verb: Verb::Write, name: name.to_string(), reason })
    }

    /// Sends the pieces in parts once they exceed [`AT_ONCE`]. Returns the bytes of the object, and the
    /// pieces not sent.
    async fn send(
        &self,
        name: &Path,
        line: Bytes,
        Pieces { pieces, room }: Pieces<'_, impl Stream<Item = Result<Bytes, String>>>,
        parts: &mut Option<WriteMultipart>,
    ) -> Result<(u64, Vec<Bytes>), String> {
        let failed = |error: Error| error.to_string();
        let (mut hasher, mut held, mut n_bytes) = (blake3::Hasher::new(), Vec::new(), 0);
        let at_once = if self.in_memory { usize::MAX } else { AT_ONCE };
        let line = futures_util::stream::once(std::future::ready(Ok(line)));
        let mut pieces = std::pin::pin!(line.chain(pieces));
        loop {
            let (piece, is_last) = match pieces.next().await {
                Some(piece) => (piece?, false),
                None => (Bytes::copy_from_slice(hasher.finalize().as_bytes()), true),
            };
            // In memory the pieces exist beside the object that they are joined to.
            if !room.try_grow(if self.in_memory { 2 * piece.len() } else { piece.len() }) {
                return Err("it has no room".to_owned());
            }
            hasher.update(&piece);
            n_bytes += piece.len();
            held.push(piece);
            if n_bytes > at_once && parts.is_none() {
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
            // Other tasks run between pieces, however fast the store is.
            tokio::task::yield_now().await;
        }
    }

    /// Opens an object that was written in pieces.
    ///
    /// # Errors
    /// [`Unavailable`]. [`DamagedObject`] if its first line is missing.
    pub(super) async fn open_pieces(
        &self,
        name: &Path,
    ) -> Result<Option<Result<OpenObject, DamagedObject>>, Unavailable> {
        let found = self.counted(Verb::Read, name, self.store.get(name).await)?;
        let Some(found) = found else { return Ok(None) };
        let (n_bytes, written_at) = (found.meta.size, SystemTime::from(found.meta.last_modified));
        let mut bytes = found.into_stream();
        let mut line = BytesMut::new();
        let first = loop {
            let next = bytes.try_next().await.map_err(|error| self.failed(Verb::Read, name, error))?;
            let Some(mut piece) = next.filter(|_| line.len() <= MAX_LINE) else {
                return Ok(Some(Err(DamagedObject("its first line is missing"))));
            };
            let searched = &piece[..piece.len().min(MAX_LINE)];
            match memchr::memchr(b'\n', searched) {
                Some(end) => {
                    line.extend_from_slice(&piece.split_to(end + 1));
                    break piece;
                }
                None => line.extend_from_slice(searched),
            }
        };
        let line = line.freeze();
        let n_body_bytes = n_bytes.saturating_sub((line.len() + HASH_BYTES) as u64);
        let mut hasher = blake3::Hasher::new();
        hasher.update(&line);
        let rest = bytes.map_err(|error| BrokenOff::Store(error.to_string())).boxed();
        let mut unread = Unread::default();
        unread.push(first);
        let body = checked(CheckedReader { hasher, unread, rest }).boxed();
        Ok(Some(Ok(OpenObject { line, written_at, n_body_bytes, body })))
    }
}

/// Pieces of an object that is being written, and its room.
struct Pieces<'a, S> {
    pieces: S,
    room: &'a mut Room,
}

/// Encodes a short object: a line and its hash.
pub(super) fn sealed(line: Bytes) -> PutPayload {
    let hash = Bytes::copy_from_slice(blake3::hash(&line).as_bytes());
    [line, hash].into_iter().collect()
}

/// Decodes the line of a short object.
///
/// # Errors
/// [`DamagedObject`] unless the object is as it was written.
pub(super) fn unsealed(bytes: &[u8]) -> Result<&[u8], DamagedObject> {
    let end = bytes.len().checked_sub(HASH_BYTES).ok_or(DamagedObject("it is truncated"))?;
    let (line, hash) = bytes.split_at(end);
    let is_whole = blake3::hash(line).as_bytes() == hash;
    if is_whole { Ok(line) } else { Err(DamagedObject("its checksum does not match")) }
}

/// Received bytes that are not handed out yet.
#[derive(Default)]
struct Unread {
    pieces: VecDeque<Bytes>,
    n_bytes: usize,
}

impl Unread {
    fn push(&mut self, piece: Bytes) {
        self.n_bytes += piece.len();
        self.pieces.push_back(piece);
    }

    /// Takes a piece from the front. The last `n_last` bytes stay.
    fn pop_before_last(&mut self, n_last: usize) -> Option<Bytes> {
        let n_free = self.n_bytes.saturating_sub(n_last).min(PIECE);
        let front = self.pieces.front_mut().filter(|_| n_free > 0)?;
        let piece = front.split_to(n_free.min(front.len()));
        if front.is_empty() {
            self.pieces.pop_front();
        }
        self.n_bytes -= piece.len();
        Some(piece)
    }
}

/// State of a reader of a body with its hash at the end.
struct CheckedReader {
    hasher: blake3::Hasher,
    unread: Unread,
    rest: BoxStream<'static, Result<Bytes, BrokenOff>>,
}

impl CheckedReader {
    /// Returns the last bytes of the body if the hash matches.
    fn end(mut self) -> Result<Bytes, BrokenOff> {
        let mut body = self.unread.pieces.iter().flatten().copied().collect::<Vec<u8>>();
        let hash = body.split_off(body.len().saturating_sub(HASH_BYTES));
        self.hasher.update(&body);
        let is_whole = self.hasher.finalize().as_bytes()[..] == hash[..];
        if is_whole { Ok(body.into()) } else { Err(BrokenOff::Damaged) }
    }
}

/// Streams the body. Its last byte is held back until the hash is checked, so a damaged body breaks off.
fn checked(state: CheckedReader) -> impl Stream<Item = Result<Bytes, BrokenOff>> {
    futures_util::stream::unfold(Some(state), |state| async move {
        let mut state = state?;
        loop {
            while let Some(piece) = state.unread.pop_before_last(HASH_BYTES + 1) {
                if !piece.is_empty() {
                    state.hasher.update(&piece);
                    return Some((Ok(piece), Some(state)));
                }
            }
            match state.rest.next().await {
                Some(Err(error)) => return Some((Err(error), None)),
                Some(Ok(more)) => state.unread.push(more),
                None => return Some((state.end(), None)),
            }
        }
    })
}
