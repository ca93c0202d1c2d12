//! Three properties of every vertex, as the rows of a table.

use super::data::Cursor;
use super::header::Element;
use super::malformed;
use crate::http::problem::Problem;
use crate::http::wire::read::reader::Table;

/// Numbers per row.
const WIDTH: usize = 3;

/// A list of rows in the data of a file.
pub(super) struct Rows<'a> {
    cursor: Cursor<'a>,
    vertices: Element<'a>,
    columns: [usize; WIDTH],
}

impl<'a> Rows<'a> {
    pub(super) fn new(cursor: Cursor<'a>, vertices: Element<'a>, columns: [usize; WIDTH]) -> Self {
        Self { cursor, vertices, columns }
    }
}

impl Table for Rows<'_> {
    fn length(&self) -> usize {
        self.vertices.count
    }

    fn width(&self) -> Option<usize> {
        Some(WIDTH)
    }

    /// Reads one row, so that what is wrong with its numbers is found before what is wrong with the next row.
    fn read(&mut self, index: usize, numbers: &mut [f64]) -> Result<usize, Box<Problem>> {
        let Self { cursor, vertices, columns } = self;
        let take = |place, x| {
            if let Some(axis) = columns.iter().position(|&column| column == place) {
                numbers[axis] = x;
            }
        };
        let read = cursor.record(vertices, index / WIDTH, take, |place| columns.contains(&place));
        read.map(|()| WIDTH).map_err(|error| Box::new(malformed(error)))
    }
}
