//! Parsing of request bodies without a service, for the fuzz targets in `fuzz/`.

use super::estimate;
use crate::http::problem::Problem;
use crate::http::wire::negotiation::{BodyFormat, Coding};
use crate::http::wire::read::body::RequestBody;
use crate::http::wire::read::limits::ParseContext;
use gramian_numerics::observer::Unobserved;

/// Names of the operations that compute. Any other name means the registration of a cloud.
pub const OPERATIONS: &[&str] = estimate::NAMES;

/// Largest size of an unpacked body, bytes.
const LIMIT: usize = 1 << 22;

const CONTEXT: ParseContext<'static> =
    ParseContext { max_points: 1000, max_queries: 1000, max_dimension: 16, observer: &Unobserved };

/// Parses a body as a request of an operation, and drops the request.
///
/// # Errors
/// Returns the problem that the request would be refused with.
pub fn read_as(operation: &str, format: BodyFormat, coding: Coding, bytes: &[u8]) -> Result<(), Problem> {
    let body = RequestBody::new(format, coding, bytes.to_vec(), LIMIT).unpack(&CONTEXT, |_| Ok(()))?;
    estimate::read_as(operation, &body, &CONTEXT)
}
