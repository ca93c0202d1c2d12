//! gzip and zstd, for request bodies and answers. Both run on the compute pool, chunk by chunk.

use std::io::{self, BufRead, Read, Write};

use flate2::read::MultiGzDecoder;
use flate2::write::GzEncoder;

use super::negotiation::Coding;
use crate::problem::Problem;
use crate::problem::catalogue;
use gramian_observer::Observer;

/// The remedy that a 413 for a body suggests.
pub const SMALLER_BODY: &str = "register the cloud once and refer to it by id, split the queries over several requests, \
     or send lists of numbers as tensors (operators raise the limit by GRAMIAN_MAX_BODY_BYTES)";

/// Compression levels, chosen on random floats in decimals. gzip 1 leaves 70 % at 200 MB/s, gzip 2 leaves 46
/// % at 127 MB/s, and gzip 6 leaves as much as gzip 2 at half its speed. zstd 1 leaves 42 % at 470 MB/s. zstd
/// 3 leaves more than zstd 1, at a third of its speed.
const GZIP_LEVEL: flate2::Compression = flate2::Compression::new(2);
const ZSTD_LEVEL: i32 = 1;

/// Largest window that a client may ask the decoder to hold, as a power of 2: the 8 MiB of RFC 9659.
const ZSTD_WINDOW_LOG: u32 = 23;

/// A streaming compressor for the body of an answer.
pub enum Compressor {
    Identity,
    Gzip(GzEncoder<Vec<u8>>),
    Zstd(zstd::stream::write::Encoder<'static, Vec<u8>>),
}

impl Compressor {
    /// Starts a stream.
    ///
    /// # Errors
    /// Fails if the library has no memory for its state.
    pub fn new(coding: Coding) -> io::Result<Self> {
        Ok(match coding {
            Coding::Identity => Self::Identity,
            Coding::Gzip => Self::Gzip(GzEncoder::new(Vec::new(), GZIP_LEVEL)),
            Coding::Zstd => Self::Zstd(zstd::stream::write::Encoder::new(Vec::new(), ZSTD_LEVEL)?),
        })
    }

    /// Compresses the next part of the body and returns the output that is ready.
    ///
    /// The output is empty while the encoder still waits for more input.
    ///
    /// # Errors
    /// No error is known: the sink is memory.
    pub fn write(&mut self, bytes: Vec<u8>) -> io::Result<Vec<u8>> {
        match self {
            Self::Identity => Ok(bytes),
            Self::Gzip(encoder) => encoder.write_all(&bytes).map(|()| std::mem::take(encoder.get_mut())),
            Self::Zstd(encoder) => encoder.write_all(&bytes).map(|()| std::mem::take(encoder.get_mut())),
        }
    }

    /// Ends the stream and returns the rest of the output.
    ///
    /// # Errors
    /// Returns the errors of [`Compressor::write`].
    pub fn finish(self) -> io::Result<Vec<u8>> {
        match self {
            Self::Identity => Ok(Vec::new()),
            Self::Gzip(encoder) => encoder.finish(),
            Self::Zstd(encoder) => encoder.finish(),
        }
    }
}

/// Bytes read at a time. Cancellation is checked once per block.
const BLOCK_BYTES: usize = 64 << 10;

/// Decompresses a body into at most `limit` bytes.
///
/// The stream is decompressed twice. The first pass only counts, so that the second can fill a buffer of the
/// right size. A growing buffer would take up to three times as much memory, and the length that a stream
/// declares may be wrong. Between the passes, `make_room` receives the decompressed length in bytes.
///
/// # Errors
/// - The errors of `make_room`.
/// - 413 `body-too-large` beyond the limit.
/// - 504 once nobody waits for the request.
/// - 400 `malformed-body` for bytes that are not of this coding.
pub fn decompress(
    bytes: Vec<u8>,
    coding: Coding,
    limit: usize,
    observer: &dyn Observer,
    make_room: impl FnOnce(usize) -> Result<(), Problem>,
) -> Result<Vec<u8>, Problem> {
    if coding == Coding::Identity {
        make_room(bytes.len())?;
        return Ok(bytes);
    }
    let packed = || CompressedReader { bytes: &bytes, observer };
    let refused = |error: io::Error| match observer.checkpoint() {
        Err(_) => Problem::cancelled(),
        Ok(()) => {
            Problem::new(catalogue::MALFORMED_BODY, format!("the body is not {}: {error}", coding.name()))
        }
    };
    let open = || -> io::Result<Box<dyn Read + '_>> {
        if coding == Coding::Gzip {
            return Ok(Box::new(MultiGzDecoder::new(packed())));
        }
        let mut decoder = zstd::stream::read::Decoder::with_buffer(packed())?;
        decoder.window_log_max(ZSTD_WINDOW_LOG)?;
        Ok(Box::new(decoder))
    };
    let mut length = 0;
    let within = read_blocks(open().map_err(refused)?, limit, observer, |block| length += block.len());
    if !within.map_err(refused)? {
        let what = "bytes of decompressed body";
        return Err(
            Problem::too_large(catalogue::BODY_TOO_LARGE, what, limit, None).with_remedy(SMALLER_BODY)
        );
    }
    make_room(length)?;
    let mut plain = Vec::with_capacity(length);
    read_blocks(open().map_err(refused)?, length, observer, |block| plain.extend_from_slice(block))
        .map_err(refused)?;
    Ok(plain)
}

/// Reads blocks until the end of the stream, and passes each to `take`. Returns false if there are more than
/// `limit` bytes.
fn read_blocks(
    mut reader: impl Read,
    limit: usize,
    observer: &dyn Observer,
    mut take: impl FnMut(&[u8]),
) -> io::Result<bool> {
    let mut block = vec![0; BLOCK_BYTES];
    let mut n_left = limit;
    loop {
        observer.checkpoint().map_err(io::Error::other)?;
        let length = match reader.read(&mut block) {
            Ok(length) => length,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => return Err(error),
        };
        if length == 0 || length > n_left {
            return Ok(length == 0);
        }
        n_left -= length;
        take(&block[..length]);
    }
}

/// A reader over a compressed body that checks for cancellation at every block.
///
/// The compressed side needs checks of its own: a long body may decompress to no bytes at all.
struct CompressedReader<'a> {
    bytes: &'a [u8],
    observer: &'a dyn Observer,
}

impl Read for CompressedReader<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let length = self.fill_buf()?.read(out)?;
        self.consume(length);
        Ok(length)
    }
}

impl BufRead for CompressedReader<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.observer.checkpoint().map_err(io::Error::other)?;
        Ok(&self.bytes[..self.bytes.len().min(BLOCK_BYTES)])
    }

    fn consume(&mut self, length: usize) {
        self.bytes = &self.bytes[length.min(self.bytes.len())..];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gramian_observer::{Stage, Unobserved};

    fn compressed(coding: Coding, chunks: &[&[u8]]) -> Vec<u8> {
        let mut compressor = Compressor::new(coding).unwrap();
        let mut out: Vec<u8> =
            chunks.iter().flat_map(|chunk| compressor.write(chunk.to_vec()).unwrap()).collect();
        out.extend(compressor.finish().unwrap());
        out
    }

    fn is_room(_n_bytes: usize) -> Result<(), Problem> {
        Ok(())
    }

    const CODINGS: [Coding; 3] = [Coding::Identity, Coding::Gzip, Coding::Zstd];

    #[test]
    fn what_is_compressed_in_chunks_decompresses_to_the_whole() {
        let text = "0.123456789,".repeat(10_000).into_bytes();
        for coding in CODINGS {
            let body = compressed(coding, &[&text[..17], b"", &text[17..50_000], &text[50_000..]]);
            assert_eq!(decompress(body, coding, text.len(), &Unobserved, is_room).unwrap(), text);
            assert_eq!(decompress(compressed(coding, &[]), coding, 0, &Unobserved, is_room).unwrap(), b"");
        }
    }

    #[test]
    fn room_is_made_for_what_there_is_before_it_is_unpacked() {
        for coding in CODINGS {
            let told = std::cell::Cell::new(0);
            let make_room = |n_bytes| {
                told.set(n_bytes);
                Err(Problem::overloaded(1))
            };
            let body = compressed(coding, &[&[7; 70_000]]);
            let refused = decompress(body, coding, 100_000, &Unobserved, make_room).err();
            assert_eq!(
                (refused.map(|problem| problem.slug()), told.get()),
                (Some(catalogue::OVERLOADED), 70_000)
            );
        }
    }

    #[test]
    fn bombs_stop_at_the_limit_and_broken_streams_are_malformed() {
        let zeros = vec![0; 100_000];
        for coding in [Coding::Gzip, Coding::Zstd] {
            let body = compressed(coding, &[&zeros]);
            let slug = |body: &[u8]| {
                decompress(body.to_vec(), coding, 99_999, &Unobserved, is_room).err().map(|p| p.slug())
            };
            assert_eq!(slug(&body), Some(catalogue::BODY_TOO_LARGE));
            for broken in [&body[..body.len() / 2], &body[..0], &body[1..], b"{}"] {
                assert_eq!(slug(broken), Some(catalogue::MALFORMED_BODY), "{coding:?} {broken:?}");
            }
        }
    }

    /// An observer whose client has gone from the start.
    struct Left;

    impl Observer for Left {
        fn enter(&self, _stage: Stage) {}

        fn is_cancelled(&self) -> bool {
            true
        }
    }

    #[test]
    fn what_nobody_waits_for_is_not_decompressed() {
        for coding in [Coding::Gzip, Coding::Zstd] {
            let body = compressed(coding, &[b"{}"]);
            let refused = decompress(body, coding, 100, &Left, is_room).err().map(|problem| problem.slug());
            assert_eq!(refused, Some(catalogue::DEADLINE_EXCEEDED));
        }
    }
}
