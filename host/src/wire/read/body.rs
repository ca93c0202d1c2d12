//! Request bodies on their way from bytes to typed requests: decompression, then parsing.

use serde::de::DeserializeOwned;

use super::limits::{Lists, ParseContext};
use super::parse::{Document, WithOperation};
use super::ply::read_ply;
use super::tensors::{read_npy, read_safetensors};
use crate::compute::FLOPS_PER_PARSED_BYTE;
use crate::problem::Problem;
use crate::wire::compression::decompress;
use crate::wire::negotiation::{BodyFormat, Coding};

/// Bytes of numbers for each byte of a body: JSON has a number in two bytes, its comma included.
pub const NUMBERS_PER_BODY: usize = 4;

/// Usual decompression ratio at most: text and numbers seldom compress to less than an eighth.
const USUAL_RATIO: usize = 8;

/// A request body as received, possibly compressed.
pub struct RequestBody {
    format: BodyFormat,
    coding: Coding,
    bytes: Vec<u8>,
    /// Largest allowed number of bytes once decompressed.
    limit: usize,
}

impl RequestBody {
    /// Wraps a body that is complete in memory. Decompressed, it may have at most `limit` bytes.
    pub fn new(format: BodyFormat, coding: Coding, bytes: Vec<u8>, limit: usize) -> Self {
        Self { format, coding, bytes, limit }
    }

    /// Returns the parameters that the memory estimate needs, without the body.
    pub fn parsing(&self) -> Parsing {
        Parsing { format: self.format, coding: self.coding, limit: self.limit }
    }

    /// Expected number of bytes once decompressed, seldom exceeded.
    pub fn n_bytes_expected(&self) -> usize {
        match self.coding {
            Coding::Identity => self.bytes.len(),
            Coding::Gzip | Coding::Zstd => self.bytes.len().saturating_mul(USUAL_RATIO).min(self.limit),
        }
    }

    /// Bytes of memory that the body occupies now.
    pub fn n_bytes(&self) -> usize {
        self.bytes.capacity()
    }

    /// Cost of parsing in flops, at most.
    pub fn flops_to_parse(&self) -> f64 {
        FLOPS_PER_PARSED_BYTE * self.n_bytes_plain() as f64
    }

    /// Upper bound of the number of bytes once decompressed.
    fn n_bytes_plain(&self) -> usize {
        match self.coding {
            Coding::Identity => self.bytes.len(),
            // A few bytes of zstd may decompress to any length.
            Coding::Gzip | Coding::Zstd => self.limit,
        }
    }

    /// Decompresses the body, on the pool. `make_room` receives the decompressed length in bytes before
    /// memory is allocated.
    ///
    /// # Errors
    /// - The errors of `make_room`.
    /// - 413 beyond the limits.
    /// - 504 once nobody waits for the request.
    /// - 400 for bytes that are not of the announced coding.
    pub fn unpack(
        self,
        context: &ParseContext<'_>,
        make_room: impl FnOnce(usize) -> Result<(), Problem>,
    ) -> Result<UnpackedBody, Problem> {
        let bytes = decompress(self.bytes, self.coding, self.limit, context.observer, make_room)?;
        Ok(UnpackedBody { format: self.format, bytes })
    }
}

/// A request body without compression.
pub struct UnpackedBody {
    format: BodyFormat,
    bytes: Vec<u8>,
}

impl UnpackedBody {
    /// Turns the body back into a request body, to be parsed again later as another type.
    pub fn into_request(self, limit: usize) -> RequestBody {
        RequestBody::new(self.format, Coding::Identity, self.bytes, limit)
    }

    /// Parses the body, on the pool.
    ///
    /// # Errors
    /// - 413 beyond the limits.
    /// - 504 once nobody waits for the request.
    /// - 400 for a body that is not of its format.
    /// - 422 with a pointer for a well-formed body that is not a `T`.
    pub fn parse<T: DeserializeOwned>(&self, context: &ParseContext<'_>) -> Result<T, Problem> {
        self.document()?.parse(context)
    }

    /// Parses the body and the member `operation` that it may have beside those of the request, on the pool.
    ///
    /// # Errors
    /// Returns the errors of [`UnpackedBody::parse`].
    pub fn parse_with_operation<T: DeserializeOwned>(
        &self,
        context: &ParseContext<'_>,
    ) -> Result<WithOperation<T>, Problem> {
        self.document()?.parse_with_operation(context)
    }

    fn document(&self) -> Result<Document<'_>, Problem> {
        match self.format {
            BodyFormat::Json => Ok(Document::json(&self.bytes)),
            BodyFormat::Safetensors => read_safetensors(&self.bytes),
            BodyFormat::Npy => read_npy(&self.bytes),
            BodyFormat::Ply => read_ply(&self.bytes),
        }
    }
}

/// Format, coding and limit of a body, which determine the memory that reading it takes.
pub struct Parsing {
    format: BodyFormat,
    coding: Coding,
    limit: usize,
}

impl Parsing {
    /// Upper bound of the bytes of memory that reading takes beside the received body.
    ///
    /// They are the decompressed body of `n_bytes_plain` bytes, if it was compressed, and the numbers parsed
    /// from it. The limits of lists bound how many numbers there can be.
    pub fn n_bytes(&self, n_bytes_plain: usize, lists: &Lists) -> usize {
        let unpacked = if self.coding == Coding::Identity { 0 } else { n_bytes_plain };
        let numbers = n_bytes_plain.saturating_mul(self.n_bytes_per_byte());
        unpacked.saturating_add(numbers.min(self.n_bytes_of_numbers(lists)))
    }

    /// Bytes of parsed numbers per byte of body, at most.
    fn n_bytes_per_byte(&self) -> usize {
        match self.format {
            // A number takes at least two bytes of JSON, including its comma, and at least four bytes in
            // tensors.
            BodyFormat::Json | BodyFormat::Safetensors | BodyFormat::Npy => size_of::<f64>() / 2,
            // A coordinate may take a single byte.
            BodyFormat::Ply => size_of::<f64>(),
        }
    }

    /// Upper bound of the bytes of all numbers in a request of this format.
    fn n_bytes_of_numbers(&self, lists: &Lists) -> usize {
        let n_bytes = lists.n_numbers(self.format).saturating_mul(size_of::<f64>());
        match self.format {
            BodyFormat::Json | BodyFormat::Safetensors | BodyFormat::Npy => n_bytes,
            // An estimate above a body's share of memory could never be granted: the client would be told to
            // retry for ever.
            BodyFormat::Ply => n_bytes.min(NUMBERS_PER_BODY.saturating_mul(self.limit)),
        }
    }
}
