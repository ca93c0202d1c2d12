//! Entity tags (RFC 9110, section 8.8.3).

use axum::http::{HeaderMap, header};

/// Returns whether `If-None-Match` has the tag.
///
/// The header is a list of tags, weak or strong, or `*` (RFC 9110, section 13.1.2).
pub fn if_none_match(headers: &HeaderMap, etag: &str) -> bool {
    let opaque = |tag: &str| tag.strip_prefix("W/").unwrap_or(tag).to_owned();
    let lines = headers.get_all(header::IF_NONE_MATCH).iter().filter_map(|value| value.to_str().ok());
    let mut tags = lines.flat_map(|line| line.split(',')).map(str::trim);
    tags.any(|tag| tag == "*" || opaque(tag) == opaque(etag))
}
