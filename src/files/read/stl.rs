//! STL: the corners of triangles, in text or binary. Equal corners are one point.

use std::collections::HashSet;

use super::FileCloud;
use super::columns::{Columns, Gaps, POSITIONS, Places};
use super::records::{ends_early, number_of};

/// Bytes before the number of facets.
const N_TITLE_BYTES: usize = 80;

/// Bytes of a facet: its normal, three corners, and two bytes of attributes.
const N_FACET_BYTES: usize = 50;

/// Bytes of the normal before the corners of a facet.
const N_NORMAL_BYTES: usize = 12;

/// Reads the corners, each once. Normals of facets are none of corners, and are skipped.
pub fn read(bytes: &[u8]) -> Result<FileCloud, String> {
    // Some binary files begin with "solid" as well, but name no facet in their title.
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(1024)]);
    let is_text =
        head.trim_start().starts_with("solid") && (head.contains("facet") || head.contains("endsolid"));
    if is_text { of_text(&String::from_utf8_lossy(bytes)) } else { of_facets(bytes) }
}

/// Distinct corners in the order of the file.
#[derive(Default)]
struct Corners {
    coordinates: [Vec<f64>; 3],
    known: HashSet<[u64; 3]>,
}

impl Corners {
    /// Adds a corner. Returns whether it is a new one.
    fn add(&mut self, corner: [f64; 3]) -> bool {
        // The sum turns -0.0 to 0.0, which is the same place.
        let is_new = self.known.insert(corner.map(|x| (x + 0.0).to_bits()));
        if is_new {
            self.coordinates.iter_mut().zip(corner).for_each(|(axis, x)| axis.push(x));
        }
        is_new
    }

    fn into_cloud(self, places: Places) -> Result<FileCloud, String> {
        let names = POSITIONS.map(str::to_owned).to_vec();
        Columns { names, numbers: self.coordinates.to_vec(), places }.into_cloud(Gaps::Refused)
    }
}

fn of_facets(bytes: &[u8]) -> Result<FileCloud, String> {
    let facets = bytes.get(N_TITLE_BYTES..).and_then(<[u8]>::split_first_chunk);
    let (&count, facets) = facets.ok_or("the file ends before its number of facets")?;
    let (count, n_there) = (u32::from_le_bytes(count) as usize, facets.len() / N_FACET_BYTES);
    if n_there < count {
        return Err(ends_early("facet", n_there, count));
    }
    let mut corners = Corners::default();
    for (at, facet) in facets.chunks_exact(N_FACET_BYTES).take(count).enumerate() {
        let numbers = facet[N_NORMAL_BYTES..].chunks_exact(4);
        let numbers: Vec<f64> = numbers
            .filter_map(|bytes| bytes.first_chunk().map(|&bytes| f64::from(f32::from_le_bytes(bytes))))
            .collect();
        for corner in numbers.chunks_exact(3) {
            if corner.iter().any(|x| !x.is_finite()) {
                return Err(format!("facet {} of {count}: a coordinate is not finite", at + 1));
            }
            corners.add([corner[0], corner[1], corner[2]]);
        }
    }
    corners.into_cloud(Places::Records("corner"))
}

fn of_text(text: &str) -> Result<FileCloud, String> {
    let (mut corners, mut lines, mut has_end) = (Corners::default(), Vec::new(), false);
    for (at, line) in text.lines().enumerate() {
        let mut words = line.split_ascii_whitespace();
        let keyword = words.next().unwrap_or_default();
        has_end |= keyword == "endsolid";
        if keyword != "vertex" {
            continue;
        }
        let refused = |reason: String| format!("line {}: {reason}", at + 1);
        let numbers = words.map(number_of).collect::<Result<Vec<f64>, String>>().map_err(refused)?;
        let &[x, y, z] = numbers.as_slice() else {
            return Err(refused(format!("a vertex has 3 numbers, not {}", numbers.len())));
        };
        if corners.add([x, y, z]) {
            lines.push(at + 1);
        }
    }
    if !has_end {
        return Err("the file ends before its line endsolid".to_owned());
    }
    corners.into_cloud(Places::Lines(lines))
}
