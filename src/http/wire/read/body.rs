//! Bodies as they came: decompressed and parsed.

use serde::de::DeserializeOwned;

use super::limits::ParseContext;
use super::parse::parse_json;
use super::ply::parse_ply;
use super::tensors::{parse_npy, parse_safetensors};
use crate::config::Config;
use crate::http::compute::FLOPS_PER_PARSED_BYTE;
use crate::http::problem::Problem;
use crate::http::wire::compression::decompress;
use crate::http::wire::negotiation::{Coding, Format};
use crate::memory::NUMBERS_PER_BODY;

/// What compression leaves of text and numbers is seldom less than an eighth.
const USUAL_RATIO: usize = 8;

/// A request as it came.
pub struct RequestBody {
    format: Format,
    coding: Coding,
    bytes: Vec<u8>,
    /// Bytes it may have once it is decompressed.
    limit: usize,
}

impl RequestBody {
    /// A body that is there already, which may have so many bytes once it is decompressed.
    pub fn new(format: Format, coding: Coding, bytes: Vec<u8>, limit: usize) -> Self {
        Self { format, coding, bytes, limit }
    }

    /// What parsing takes, which is told without the body.
    pub fn parsing(&self) -> Parsing {
        Parsing { format: self.format, coding: self.coding, limit: self.limit }
    }

    /// Bytes that it will have when it is unpacked, as nearly always.
    pub fn n_bytes_expected(&self) -> usize {
        match self.coding {
            Coding::Identity => self.bytes.len(),
            Coding::Gzip | Coding::Zstd => self.bytes.len().saturating_mul(USUAL_RATIO).min(self.limit),
        }
    }

    /// Bytes that it holds as it is.
    pub fn n_bytes(&self) -> usize {
        self.bytes.capacity()
    }

    /// What parsing costs, in flops.
    pub fn flops_to_parse(&self) -> f64 {
        FLOPS_PER_PARSED_BYTE * self.n_bytes_plain() as f64
    }

    /// Bytes without compression at most.
    fn n_bytes_plain(&self) -> usize {
        match self.coding {
            Coding::Identity => self.bytes.len(),
            // A few bytes of zstd may unpack to any number.
            Coding::Gzip | Coding::Zstd => self.limit,
        }
    }

    /// Decompresses it, on the pool. `make_room` is told how many bytes there are before they are unpacked.
    ///
    /// # Errors
    /// Those of `make_room`, 413 beyond the limits, 504 once nobody waits for it, 400 for what is not of its coding.
    pub fn unpack(
        self,
        context: &ParseContext<'_>,
        make_room: impl FnOnce(usize) -> Result<(), Problem>,
    ) -> Result<UnpackedBody, Problem> {
        let bytes = decompress(self.bytes, self.coding, self.limit, context.observer, make_room)?;
        Ok(UnpackedBody { format: self.format, bytes })
    }
}

/// A request without compression.
pub struct UnpackedBody {
    format: Format,
    bytes: Vec<u8>,
}

impl UnpackedBody {
    /// To be parsed as something else later.
    pub fn into_request(self, limit: usize) -> RequestBody {
        RequestBody::new(self.format, Coding::Identity, self.bytes, limit)
    }

    /// Parses it, on the pool.
    ///
    /// # Errors
    /// 413 beyond the limits, 504 once nobody waits for it, 400 for what is not of its format, 422 with a pointer for what is, but
    /// not this request.
    pub fn parse<T: DeserializeOwned>(&self, context: &ParseContext<'_>) -> Result<T, Problem> {
        match self.format {
            Format::Json => parse_json(&self.bytes, context),
            Format::Safetensors => parse_safetensors(&self.bytes, context),
            Format::Npy => parse_npy(&self.bytes, context),
            Format::Ply => parse_ply(&self.bytes, context),
        }
    }
}

/// How a body becomes a request, and so how many bytes that takes.
pub struct Parsing {
    format: Format,
    coding: Coding,
    limit: usize,
}

impl Parsing {
    /// Bytes that it takes beside the body at most, once it is unpacked to so many: these, and the numbers in it, of which the
    /// limits leave so many.
    pub fn n_bytes(&self, n_bytes_plain: usize, config: &Config) -> usize {
        let unpacked = if self.coding == Coding::Identity { 0 } else { n_bytes_plain };
        let numbers = n_bytes_plain.saturating_mul(self.n_bytes_per_byte());
        unpacked.saturating_add(numbers.min(self.n_bytes_of_numbers(config)))
    }

    /// Bytes of numbers that a byte can stand for.
    fn n_bytes_per_byte(&self) -> usize {
        match self.format {
            // A number takes two bytes of JSON at least, its comma included, and four in tensors.
            Format::Json | Format::Safetensors | Format::Npy => size_of::<f64>() / 2,
            // Coordinates may have eight bits.
            Format::Ply => size_of::<f64>(),
        }
    }

    /// Bytes of all numbers that a request of this format may have.
    fn n_bytes_of_numbers(&self, config: &Config) -> usize {
        let n_rows = config.max_points.saturating_add(config.max_queries);
        match self.format {
            Format::Json | Format::Safetensors | Format::Npy => {
                n_rows.saturating_mul(4 * size_of::<f64>()).saturating_mul(config.max_dimension)
            }
            // Points and normals in three dimensions. What is beyond the share of a body (`memory.rs`) could never be had: a
            // body would be asked to come again for ever.
            Format::Ply => (6 * size_of::<f64>())
                .saturating_mul(config.max_points)
                .min(NUMBERS_PER_BODY.saturating_mul(self.limit)),
        }
    }
}
