//! Clouds in files of other programs: one reader for each format, and one result for all of them.
//!
//! `page/model/files.js` and `gramian.arguments.files` in Python read the same formats. tests/clouds and
//! tests/tables hold the three to the same outcomes. Refusals speak of lines, vertices and points, counted
//! from 1. No reader allocates by the counts of a header alone.

pub mod formats;

mod columns;
mod json;
mod las;
mod lzf;
mod npy;
mod obj;
mod pcd;
mod ply;
mod records;
mod stl;
mod table;

use std::fmt;

use formats::Format;

/// The points of a file, with everything else that it has for them.
#[derive(Debug, Default, PartialEq)]
pub struct FileCloud {
    /// Positions, a row of `dimension` coordinates for each point.
    pub points: Vec<f64>,
    pub dimension: usize,
    /// Normals in rows as long as those of the points.
    pub normals: Option<Vec<f64>>,
    /// Red, green and blue of each point, from 0 to 1.
    pub colours: Option<Vec<f64>>,
    /// Further columns with their names, in the order of the file. Missing values are NaN.
    pub columns: Vec<(String, Vec<f64>)>,
    /// Number of rows that were left out because they have no position.
    pub n_left_out: usize,
}

impl FileCloud {
    /// Number of points.
    pub fn n_points(&self) -> usize {
        self.points.len().checked_div(self.dimension).unwrap_or_default()
    }

    /// A sentence about the rows that were left out, if there are any.
    pub fn left_out(&self) -> Option<String> {
        let (n, all) = (self.n_left_out, self.n_left_out + self.n_points());
        let points = if all == 1 { "point" } else { "points" };
        (n > 0).then(|| format!("left out without a position: {n} of {all} {points}"))
    }
}

/// The reason why a file cannot be read, and where.
#[derive(Debug, PartialEq, Eq)]
pub struct ReadError(String);

impl fmt::Display for ReadError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

/// Reads a cloud by the content of its file, or where that decides nothing, by the ending of its name.
///
/// # Errors
/// Says what is wrong, in which line or at which point, and where it helps what to do.
pub fn read(name: &str, bytes: &[u8]) -> Result<FileCloud, ReadError> {
    let found = match Format::of(name, bytes) {
        Err(reason) => Err(reason),
        Ok(Format::Ply) => ply::read(bytes),
        Ok(Format::Pcd) => pcd::read(bytes),
        Ok(Format::Las) => las::read(bytes),
        Ok(Format::Npy) => npy::read(bytes),
        Ok(Format::Stl) => stl::read(bytes),
        Ok(Format::Obj) => obj::read(bytes),
        Ok(Format::Json) => json::read(bytes),
        Ok(Format::Rows) => table::read(bytes),
    };
    found.map_err(ReadError)
}

/// The text of a file.
fn text_of(bytes: &[u8]) -> Result<&str, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "the file is not UTF-8: save it in that encoding")?;
    // Spreadsheets begin a text with a mark of its encoding.
    Ok(text.strip_prefix('\u{feff}').unwrap_or(text))
}

/// The beginning of a text of the file that is repeated in a refusal.
fn shown(text: &str) -> String {
    text.chars().take(40).collect()
}

#[cfg(test)]
mod tests;
