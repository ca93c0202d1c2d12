//! Bodies in: bytes within the limit, decompressed and parsed.

use axum::body::Body;
use axum::http::{HeaderMap, header};
use http_body_util::BodyExt;
use serde::de::DeserializeOwned;

use super::compression::decompress;
use super::limits::ParseContext;
use super::negotiation::{Coding, Format, announced};
use super::parse::parse_json;
use super::problem::Problem;
use super::slug::Slug;
use super::tensors::{parse_npy, parse_safetensors};

/// Bytes read and thrown away behind a body that is too large, so that a client which only listens after sending gets its
/// answer instead of a broken connection.
const MAX_DRAINED_BYTES: usize = 64 << 20;

/// Bytes that are allocated on the word of a Content-Length; beyond it the buffer grows as bytes come.
const MAX_TRUSTED_BYTES: usize = 1 << 20;

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

    /// Decompresses and parses, on the pool.
    ///
    /// # Errors
    /// 413 beyond the limits, 504 once nobody waits for it, 400 for what is not of its format, 422 with a pointer for what is, but not this request.
    pub fn parse<T: DeserializeOwned>(self, context: &ParseContext<'_>) -> Result<T, Problem> {
        let bytes = decompress(self.bytes, self.coding, self.limit, context.observer)?;
        match self.format {
            Format::Json => parse_json(&bytes, context),
            Format::Safetensors => parse_safetensors(&bytes, context),
            Format::Npy => parse_npy(&bytes, context),
        }
    }
}

/// Reads a body of at most `limit` bytes, in one of the formats.
///
/// # Errors
/// 415 unless the headers announce one of them, 413 beyond the limit, 400 if the connection breaks off.
pub async fn read_body(
    headers: &HeaderMap,
    body: Body,
    formats: &[Format],
    limit: usize,
) -> Result<RequestBody, Problem> {
    let (format, coding) = announced(headers, formats)?;
    let bytes = read_bytes(headers, body, limit).await?;
    Ok(RequestBody::new(format, coding, bytes, limit))
}

async fn read_bytes(headers: &HeaderMap, body: Body, limit: usize) -> Result<Vec<u8>, Problem> {
    let length = headers
        .get(header::CONTENT_LENGTH)
        .and_then(|length| length.to_str().ok())
        .and_then(|length| length.parse::<usize>().ok());
    if let Some(required) = length.filter(|&length| length > limit) {
        drain(body).await;
        return Err(Problem::too_large(Slug::BodyTooLarge, "bytes of body", limit, Some(required)));
    }
    let mut body = body;
    let mut bytes = Vec::with_capacity(length.unwrap_or(0).min(MAX_TRUSTED_BYTES));
    while let Some(frame) = body.frame().await {
        let frame = frame.map_err(|_| Problem::new(Slug::MalformedBody, "the body broke off"))?;
        let Ok(data) = frame.into_data() else { continue };
        if bytes.len() + data.len() > limit {
            drain(body).await;
            return Err(Problem::too_large(Slug::BodyTooLarge, "bytes of body", limit, None));
        }
        bytes.extend_from_slice(&data);
    }
    Ok(bytes)
}

async fn drain(mut body: Body) {
    let mut drained = 0;
    while let Some(Ok(frame)) = body.frame().await {
        drained += frame.into_data().map_or(0, |data| data.len());
        if drained > MAX_DRAINED_BYTES {
            break;
        }
    }
}
