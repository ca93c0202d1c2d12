//! Bodies as they came: decompressed and parsed.

use serde::de::DeserializeOwned;

use super::limits::ParseContext;
use super::parse::parse_json;
use super::tensors::{parse_npy, parse_safetensors};
use crate::config::Config;
use crate::http::compute::FLOPS_PER_PARSED_BYTE;
use crate::http::problem::Problem;
use crate::http::wire::compression::decompress;
use crate::http::wire::negotiation::{Coding, Format};

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

    /// Bytes that [`RequestBody::parse`] takes beside the body at most: the body unpacked, and the numbers in it, of which the
    /// limits leave so many. A number takes two bytes of JSON at least, its comma included.
    pub fn n_bytes_to_parse(&self, config: &Config) -> usize {
        let plain = self.n_bytes_plain();
        let unpacked = if self.coding == Coding::Identity { 0 } else { plain };
        let n_rows = 4 * config.max_points.saturating_add(config.max_queries);
        let most = n_rows.saturating_mul(config.max_dimension).saturating_mul(size_of::<f64>());
        unpacked + plain.saturating_mul(size_of::<f64>() / 2).min(most)
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

    /// Decompresses and parses, on the pool.
    ///
    /// # Errors
    /// 413 beyond the limits, 504 once nobody waits for it, 400 for what is not of its format, 422 with a pointer for what is,
    /// but not this request.
    pub fn parse<T: DeserializeOwned>(self, context: &ParseContext<'_>) -> Result<T, Problem> {
        let bytes = decompress(self.bytes, self.coding, self.limit, context.observer)?;
        match self.format {
            Format::Json => parse_json(&bytes, context),
            Format::Safetensors => parse_safetensors(&bytes, context),
            Format::Npy => parse_npy(&bytes, context),
        }
    }
}
