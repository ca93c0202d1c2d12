//! An answer as received from the socket.

use std::io::Read;

use reqwest::header::{HeaderMap, HeaderName, HeaderValue};
use serde_json::Value;

/// An answer, read to its end. The body is as it was sent, compressed or not.
#[derive(Clone)]
pub struct AnswerParts {
    pub status: u16,
    pub headers: HeaderMap,
    pub bytes: Vec<u8>,
}

impl AnswerParts {
    /// Parses an HTTP/1.1 answer whose body is neither chunked nor compressed.
    pub fn parse(text: &str) -> Self {
        let (head, body) = text.split_once("\r\n\r\n").unwrap();
        let (first, fields) = head.split_once("\r\n").unwrap();
        let headers = fields.split("\r\n").map(|field| {
            let (name, value) = field.split_once(':').unwrap();
            (name.parse::<HeaderName>().unwrap(), HeaderValue::from_str(value.trim()).unwrap())
        });
        let status = first.split(' ').nth(1).unwrap().parse().unwrap();
        Self { status, headers: headers.collect(), bytes: body.as_bytes().to_vec() }
    }

    pub fn header(&self, name: &str) -> &str {
        self.headers.get(name).map_or("", |value| value.to_str().unwrap())
    }

    pub fn text(&self) -> &str {
        str::from_utf8(&self.bytes).unwrap()
    }

    /// The content type without its parameters.
    pub fn media_type(&self) -> String {
        self.header("content-type").split(';').next().unwrap().trim().to_ascii_lowercase()
    }

    /// Returns the decompressed body as JSON, or `None` if it is not JSON.
    pub fn json(&self) -> Option<Value> {
        match self.header("content-encoding") {
            "" => serde_json::from_slice(&self.bytes).ok(),
            coding => serde_json::from_slice(&decompressed(coding, &self.bytes)).ok(),
        }
    }
}

pub fn decompressed(coding: &str, bytes: &[u8]) -> Vec<u8> {
    if coding == "zstd" {
        return zstd::decode_all(bytes).unwrap();
    }
    let mut plain = Vec::new();
    // Reads a single gzip member, as browsers read only the first.
    let mut decoder = flate2::bufread::GzDecoder::new(bytes);
    decoder.read_to_end(&mut plain).unwrap();
    assert!(decoder.into_inner().is_empty());
    plain
}
