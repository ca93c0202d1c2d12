//! Encoding of an answer as a body: at once if it is small, otherwise in chunks while it is sent.
//!
//! STREAMING. A chunk of numbers becomes text on the compute pool shortly before it is sent, several chunks
//! at a time and in order. So a matrix never exists as text. A client that reads slowly holds a few chunks of
//! text beside the numbers themselves, and no thread waits for it.
//!
//! Each job is a task of its own. Otherwise the stream of a stalled client, which is not polled, could sit in
//! the queue for a permit, receive one, and keep it from everyone else.

use std::io;
use std::sync::Arc;

use axum::body::Body;
use axum::http::{HeaderValue, header};
use axum::response::{IntoResponse, Response};
use bytes::Bytes;
use futures_util::{Stream, StreamExt, TryStreamExt, stream};
use rayon::prelude::*;

use super::answer::Answer;
use super::chunk::{Chunk, split_bytes};
use crate::compute::Compute;
use crate::memory::Owner;
use crate::memory::budget::Reservation;
use crate::problem::Problem;
use crate::wire::compression::Compressor;
use crate::wire::negotiation::{AnswerEncoding, Coding, Format};

/// Most chunks that are encoded at once, in parallel. Longer answers are streamed.
const CHUNKS_AT_ONCE: usize = 4;

/// Bytes of chunks that are encoded but not sent, per thread: two chunks, with room for the compressor's
/// copy.
const BYTES_UNDER_WAY: usize = 1 << 20;

/// Smallest body that is compressed. Below, compression saves less than its header and time cost.
const LEAST_COMPRESSED_BYTES: usize = 1 << 10;

/// An encoded answer, ready to be sent.
pub struct EncodedAnswer {
    format: Format,
    coding: Coding,
    body: Encoding,
}

enum Encoding {
    Whole(Vec<Bytes>),
    Chunks(Vec<Chunk>, Box<Compressor>),
}

impl EncodedAnswer {
    /// Encodes an answer, as far as it is encoded before the first byte is sent.
    ///
    /// # Errors
    /// Returns the errors of [`Answer::into_parts`], or 500 `internal` if a compressor fails.
    pub fn of(answer: Box<dyn Answer>, wanted: AnswerEncoding) -> Result<Self, Problem> {
        let AnswerEncoding { format, coding } = wanted;
        let chunks = answer.into_parts()?.write(format)?;
        let encoded = |coding, body| Ok(Self { format, coding, body });
        if coding == Coding::Identity
            && let Some(bytes) = chunks.iter().map(Chunk::as_bytes).collect::<Option<Vec<_>>>()
        {
            return encoded(coding, Encoding::Whole(bytes.concat()));
        }
        let failed = |_: io::Error| Problem::internal();
        let chunks = split_bytes(chunks);
        if chunks.len() > CHUNKS_AT_ONCE {
            let compressor = Box::new(Compressor::new(coding).map_err(failed)?);
            return encoded(coding, Encoding::Chunks(chunks, compressor));
        }
        let plain: Vec<Vec<u8>> = chunks.par_iter().map(Chunk::to_bytes).collect();
        if coding == Coding::Identity || plain.iter().map(Vec::len).sum::<usize>() < LEAST_COMPRESSED_BYTES {
            let frames = plain.into_iter().map(Bytes::from).collect();
            return encoded(Coding::Identity, Encoding::Whole(frames));
        }
        let mut compressor = Compressor::new(coding).map_err(failed)?;
        let mut body = compressor.write(plain.concat()).map_err(failed)?;
        body.extend(compressor.finish().map_err(failed)?);
        encoded(coding, Encoding::Whole(vec![body.into()]))
    }

    /// Whether encoding continues while the body is sent.
    pub fn is_streamed(&self) -> bool {
        matches!(self.body, Encoding::Chunks(..))
    }

    /// Bytes held by the body until it is sent. An array is held until its last chunk is written.
    pub fn n_bytes(&self) -> usize {
        match &self.body {
            Encoding::Whole(frames) => frames.iter().map(Bytes::len).sum(),
            Encoding::Chunks(chunks, _) => chunks.iter().map(Chunk::n_bytes).sum(),
        }
    }

    /// Returns the response with the headers that describe its body. The body holds `memory` until it is sent
    /// or dropped.
    pub fn into_response(self, compute: &Arc<Compute>, mut memory: Reservation) -> Response {
        let (owner, n_bytes) = (memory.owner(), self.n_bytes());
        memory.shrink_to(n_bytes.saturating_add(BYTES_UNDER_WAY * compute.n_threads()));
        let (body, length) = match self.body {
            Encoding::Whole(frames) => {
                let length = frames.iter().map(Bytes::len).sum::<usize>();
                let frames = stream::iter(frames.into_iter().map(Ok::<_, io::Error>));
                (Body::from_stream(holding(frames, memory)), Some(length))
            }
            Encoding::Chunks(chunks, compressor) => {
                let written = written(chunks, compute.clone(), owner);
                let compressed = compressed(written, compressor, compute.clone(), owner);
                (Body::from_stream(holding(compressed, memory)), None)
            }
        };
        let mut response = body.into_response();
        let headers = response.headers_mut();
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(self.format.media_type()));
        headers.insert(header::VARY, HeaderValue::from_static("accept, accept-encoding"));
        if let Some(length) = length {
            headers.insert(header::CONTENT_LENGTH, length.into());
        }
        if self.coding != Coding::Identity {
            headers.insert(header::CONTENT_ENCODING, HeaderValue::from_static(self.coding.name()));
        }
        response
    }
}

/// Ties a memory reservation to the lifetime of a stream.
pub fn holding<S: Stream>(stream: S, held: Reservation) -> impl Stream<Item = S::Item> {
    stream.map(move |item| {
        let _ = &held;
        item
    })
}

/// Streams the bytes of chunks in order. Twice as many chunks as threads are in progress.
fn written(
    chunks: Vec<Chunk>,
    compute: Arc<Compute>,
    owner: Owner,
) -> impl Stream<Item = io::Result<Vec<u8>>> + Send {
    let n_under_way = 2 * compute.n_threads();
    let write = move |chunk: Chunk| on_pool(compute.clone(), owner, move || Ok(chunk.to_bytes()));
    stream::iter(chunks).map(write).buffered(n_under_way)
}

/// Compresses a stream. The compressor moves from job to job.
fn compressed(
    plain: impl Stream<Item = io::Result<Vec<u8>>> + Send,
    compressor: Box<Compressor>,
    compute: Arc<Compute>,
    owner: Owner,
) -> impl Stream<Item = io::Result<Bytes>> + Send {
    let step = move |(mut plain, compressor): (std::pin::Pin<Box<_>>, Option<Box<Compressor>>)| {
        let compute = compute.clone();
        async move {
            let Some(mut compressor) = compressor else { return Ok(None) };
            let next: Option<io::Result<Vec<u8>>> = StreamExt::next(&mut plain).await;
            let (bytes, compressor) = match (next.transpose()?, &*compressor) {
                (Some(bytes), Compressor::Identity) => (bytes, Some(compressor)),
                (Some(bytes), _) => {
                    on_pool(compute, owner, move || Ok((compressor.write(bytes)?, Some(compressor)))).await?
                }
                (None, _) => (on_pool(compute, owner, move || compressor.finish()).await?, None),
            };
            Ok(Some((Bytes::from(bytes), (plain, compressor))))
        }
    };
    let compressed = stream::try_unfold((Box::pin(plain), Some(compressor)), step);
    // An empty frame would end a chunked body.
    compressed.try_filter(|bytes| std::future::ready(!bytes.is_empty()))
}

/// Runs a job as a task of its own, so that it holds a permit only while it computes, even when nobody polls
/// the stream.
async fn on_pool<T: Send + 'static>(
    compute: Arc<Compute>,
    owner: Owner,
    job: impl FnOnce() -> io::Result<T> + Send + 'static,
) -> io::Result<T> {
    let task = tokio::spawn(async move { compute.run_small(owner, job).await });
    match task.await {
        Ok(Ok(result)) => result,
        // The head of the answer is already sent, so the body can only be aborted.
        Ok(Err(_)) | Err(_) => Err(io::Error::other("a job of the encoder failed")),
    }
}
