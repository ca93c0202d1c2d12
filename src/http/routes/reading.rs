//! Parsing of request bodies without a service, for the fuzz targets in `fuzz/`.

use super::clouds::CloudRequest;
pub use super::estimate::OPERATIONS;
use crate::http::problem::Problem;
use crate::http::serve::operation::AnyOperation;
use crate::http::wire::negotiation::{BodyFormat, Coding};
use crate::http::wire::read::body::{RequestBody, UnpackedBody};
use crate::http::wire::read::limits::ParseContext;
use gramian_numerics::observer::Unobserved;

/// Largest size of an unpacked body, bytes.
const LIMIT: usize = 1 << 22;

const CONTEXT: ParseContext<'static> =
    ParseContext { max_points: 1000, max_queries: 1000, max_dimension: 16, observer: &Unobserved };

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
    (operation.parse)(&unpacked(format, coding, bytes)?, &CONTEXT).map(drop)
}

/// Parses a body as the registration of a cloud, and drops the request.
///
/// # Errors
/// Returns the problem that the request would be refused with.
pub fn read_cloud(format: BodyFormat, coding: Coding, bytes: &[u8]) -> Result<(), Problem> {
    unpacked(format, coding, bytes)?.parse::<CloudRequest>(&CONTEXT).map(drop)
}

fn unpacked(format: BodyFormat, coding: Coding, bytes: &[u8]) -> Result<UnpackedBody, Problem> {
    RequestBody::new(format, coding, bytes.to_vec(), LIMIT).unpack(&CONTEXT, |_| Ok(()))
}
