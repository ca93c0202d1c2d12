//! Parsing of request bodies without a service, for the fuzz targets in `fuzz/`.

use super::clouds::CloudRequest;
pub use super::estimate::OPERATIONS;
use crate::http::fields::limits::{Limits, unobserved};
use crate::http::problem::Problem;
use crate::http::serve::operation::AnyOperation;
use gramian_host::wire::negotiation::{BodyFormat, Coding};
use gramian_host::wire::read::body::{RequestBody, UnpackedBody};
use gramian_host::wire::read::limits::ParseContext;

/// Largest size of an unpacked body, bytes.
const LIMIT: usize = 1 << 22;

const LIMITS: Limits = Limits { max_points: 1000, max_queries: 1000, max_dimension: 16 };

/// Parses a body as a request of an operation, and drops the request.
///
/// # Errors
/// Returns the problem that the request would be refused with.
pub fn read_as(
    operation: AnyOperation,
    format: BodyFormat,
    coding: Coding,
    bytes: &[u8],
) -> Result<(), Problem> {
    let lists = LIMITS.lists();
    let context = unobserved(&lists);
    (operation.parse)(&unpacked(format, coding, bytes, &context)?, &context).map(drop)
}

/// Parses a body as the registration of a cloud, and drops the request.
///
/// # Errors
/// Returns the problem that the request would be refused with.
pub fn read_cloud(format: BodyFormat, coding: Coding, bytes: &[u8]) -> Result<(), Problem> {
    let lists = LIMITS.lists();
    let context = unobserved(&lists);
    unpacked(format, coding, bytes, &context)?.parse::<CloudRequest>(&context).map(drop)
}

fn unpacked(
    format: BodyFormat,
    coding: Coding,
    bytes: &[u8],
    context: &ParseContext<'_>,
) -> Result<UnpackedBody, Problem> {
    RequestBody::new(format, coding, bytes.to_vec(), LIMIT).unpack(context, |_| Ok(()))
}
