//! Clouds in PLY 1.0, the format of scanners, in text or binary of either byte order.
//!
//! Only the vertices are read: x y z as `points` and, if all three are present, nx ny nz as `normals`. Other
//! properties and elements are skipped. Data after the vertices is ignored.
//!
//! Numbers pass one by one from the body into the same types as those of JSON, under the same guard. So
//! limits, pointers and cancellation are those of every format, and no memory is needed beside the two flat
//! arrays. Crates that read PLY build a map or struct per vertex, and allocate by the counts of the header,
//! which the client controls.

pub mod data;
pub mod header;

mod rows;

use super::parse::Document;
use super::reader::NamedTable;
use crate::problem::Problem;
use crate::problem::catalogue;
use data::Cursor;
use header::{Element, Header};
use rows::Rows;

/// Longest header in bytes, as in the other formats. Headers of scanners take some hundreds of bytes.
const MAX_HEADER_BYTES: usize = 64 << 10;

const COORDINATES: [&str; 3] = ["x", "y", "z"];
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];

/// Reason why a body is not valid PLY.
#[derive(Debug, thiserror::Error)]
pub enum PlyError {
    #[error("the body is not PLY: its first line is not \"ply\"")]
    NoMagic,
    #[error("the header does not end: there is no line \"end_header\" in its first {MAX_HEADER_BYTES} bytes")]
    EndlessHeader,
    #[error("line {line} of the header: {reason}")]
    Header { line: usize, reason: String },
    #[error(
        "the header announces {announced} of element {element}, but at most {room} fit into what follows it"
    )]
    Announced { element: String, announced: usize, room: usize },
    #[error("the body ends within element {element}, at number {index} of {announced}")]
    EndsEarly { element: String, index: usize, announced: usize },
    #[error("{element} {index}: a list has {length} entries")]
    ListLength { element: String, index: usize, length: f64 },
    #[error("line {line}, element {element}: {reason}")]
    Text { line: usize, element: String, reason: String },
}

fn malformed(error: PlyError) -> Problem {
    Problem::new(catalogue::MALFORMED_BODY, error.to_string())
        .with_remedy("write the file again, as PLY 1.0 with the counts that it has")
}

/// Reads the header of a file, whose vertices are the members `points` and `normals`.
///
/// # Errors
/// - 400 for a body that is not PLY, or that ends before its vertices begin.
/// - 422 with a pointer for vertices without coordinates.
pub fn read_ply(bytes: &[u8]) -> Result<Document<'_>, Problem> {
    let (header, data) = Header::parse(bytes).map_err(malformed)?;
    let (before, vertices) = split_at_vertices(&header)?;
    let Some(coordinates) = vertices.columns(COORDINATES) else { return Err(without_coordinates(vertices)) };
    let mut cursor = Cursor::new(data, &header);
    before.iter().try_for_each(|element| cursor.skip(element)).map_err(malformed)?;
    cursor.check_room(vertices).map_err(malformed)?;
    let table = |name: &str, columns| {
        let rows = Rows::new(cursor, vertices.clone(), columns);
        NamedTable::new(vec![name.to_owned()], Ok(Box::new(rows)))
    };
    let points = table("points", coordinates);
    let normals = vertices.columns(NORMAL).map(|columns| table("normals", columns));
    Ok(Document::with_tables(b"{}".into(), [points].into_iter().chain(normals).collect()))
}

/// Returns the elements before the vertices, and the vertices.
fn split_at_vertices<'h, 'a>(
    header: &'h Header<'a>,
) -> Result<(&'h [Element<'a>], &'h Element<'a>), Problem> {
    let at = header.elements.iter().position(|element| element.name == "vertex");
    match at.map(|at| header.elements.split_at(at)) {
        Some((before, [vertices, ..])) => Ok((before, vertices)),
        _ => Err(Problem::invalid_request("/points", "the file has no element vertex")),
    }
}

fn without_coordinates(vertices: &Element<'_>) -> Problem {
    let missing = COORDINATES.into_iter().find(|name| vertices.column(name).is_none()).unwrap_or_default();
    let detail = format!("element vertex has no number {missing}");
    Problem::invalid_request("/points", detail).with_remedy("give it the properties x, y and z")
}

#[cfg(test)]
mod tests;
