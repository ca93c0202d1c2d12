//! Chunks of a body: bytes, and numbers that are converted to text only when the chunk is sent.

use std::ops::Range;
use std::sync::Arc;

use bytes::Bytes;

use super::array::Array;

/// Numbers per chunk.
///
/// A chunk makes some 170 kB of JSON and takes 150 µs of one core. Handing a job to the pool takes some 10
/// µs.
const NUMBERS_PER_CHUNK: usize = 1 << 13;

/// Bytes per chunk when a binary body is compressed.
const BYTES_PER_CHUNK: usize = 1 << 18;

/// A part of a body, converted to bytes on demand.
#[derive(Debug)]
pub struct Chunk(Vec<Piece>);

#[derive(Debug)]
enum Piece {
    Bytes(Bytes),
    Numbers(Arc<Array>, Range<usize>),
}

impl Chunk {
    /// A chunk of ready bytes.
    pub fn of(bytes: Bytes) -> Self {
        Self(vec![Piece::Bytes(bytes)])
    }

    /// Appends the bytes of the chunk.
    pub fn write(&self, out: &mut Vec<u8>) {
        for piece in &self.0 {
            match piece {
                Piece::Bytes(bytes) => out.extend_from_slice(bytes),
                Piece::Numbers(array, range) => array.write_json(range.clone(), out),
            }
        }
    }

    /// Bytes of memory held by the chunk.
    pub fn n_bytes(&self) -> usize {
        let of = |piece: &Piece| match piece {
            Piece::Bytes(bytes) => bytes.len(),
            Piece::Numbers(_, range) => range.len() * size_of::<f64>(),
        };
        self.0.iter().map(of).sum()
    }

    /// Returns the bytes of the chunk.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        self.write(&mut out);
        out
    }

    /// Returns the bytes if the chunk has no numbers left to convert.
    pub fn as_bytes(&self) -> Option<Vec<Bytes>> {
        let bytes = |piece: &Piece| match piece {
            Piece::Bytes(bytes) => Some(bytes.clone()),
            Piece::Numbers(..) => None,
        };
        self.0.iter().map(bytes).collect()
    }
}

/// Collects text and numbers into chunks of even cost.
#[derive(Default)]
pub struct ChunkBuilder {
    finished: Vec<Chunk>,
    text: Vec<u8>,
    pieces: Vec<Piece>,
    n_numbers: usize,
}

impl ChunkBuilder {
    pub fn text(&mut self, text: &[u8]) {
        self.text.extend_from_slice(text);
    }

    pub fn numbers(&mut self, array: Arc<Array>) {
        let n = array.n_numbers();
        let mut start = 0;
        loop {
            self.end_text();
            let end = n.min(start + NUMBERS_PER_CHUNK - self.n_numbers);
            self.pieces.push(Piece::Numbers(array.clone(), start..end));
            self.n_numbers += end - start;
            if self.n_numbers == NUMBERS_PER_CHUNK {
                self.finished.push(Chunk(std::mem::take(&mut self.pieces)));
                self.n_numbers = 0;
            }
            if end == n {
                return;
            }
            start = end;
        }
    }

    pub fn finish(mut self) -> Vec<Chunk> {
        self.end_text();
        if !self.pieces.is_empty() {
            self.finished.push(Chunk(self.pieces));
        }
        self.finished
    }

    fn end_text(&mut self) {
        if !self.text.is_empty() {
            self.pieces.push(Piece::Bytes(std::mem::take(&mut self.text).into()));
        }
    }
}

/// Splits large chunks of bytes, so that compressing a chunk is a small job.
pub fn split_bytes(chunks: Vec<Chunk>) -> Vec<Chunk> {
    let split = |chunk: Chunk| match <[Piece; 1]>::try_from(chunk.0) {
        Ok([Piece::Bytes(bytes)]) => (0..bytes.len().max(1))
            .step_by(BYTES_PER_CHUNK)
            .map(|start| Chunk::of(bytes.slice(start..bytes.len().min(start + BYTES_PER_CHUNK))))
            .collect(),
        Ok(pieces) => vec![Chunk(pieces.into())],
        Err(pieces) => vec![Chunk(pieces)],
    };
    chunks.into_iter().flat_map(split).collect()
}
