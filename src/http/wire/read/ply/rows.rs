//! Three properties of every vertex, as the rows of a table.

use super::data::Cursor;
use super::header::Element;
use super::{PlyError, malformed};
use crate::http::problem::Problem;

/// A list of rows in the data of a file.
pub struct Rows<'a> {
    cursor: Cursor<'a>,
    vertices: Element<'a>,
    columns: [usize; Rows::WIDTH],
    /// Index of the next vertex.
    next: usize,
    /// Numbers of the vertex before it.
    row: [f64; Rows::WIDTH],
}

impl<'a> Rows<'a> {
    /// Numbers per row.
    pub const WIDTH: usize = 3;

    pub(super) fn new(cursor: Cursor<'a>, vertices: Element<'a>, columns: [usize; Rows::WIDTH]) -> Self {
        Self { cursor, vertices, columns, next: 0, row: [0.0; Rows::WIDTH] }
    }

    pub fn length(&self) -> usize {
        self.vertices.count
    }

    /// Returns a number of a row that is the current one or follows it.
    ///
    /// # Errors
    /// 400 if the file ends before the row or has something else there.
    pub fn number(&mut self, row: usize, column: usize) -> Result<f64, Box<Problem>> {
        while self.next <= row {
            self.read_row().map_err(|error| Box::new(malformed(error)))?;
        }
        Ok(self.row[column])
    }

    fn read_row(&mut self) -> Result<(), PlyError> {
        let Self { cursor, vertices, columns, next, row } = self;
        let take = |place, x| {
            if let Some(axis) = columns.iter().position(|&column| column == place) {
                row[axis] = x;
            }
        };
        cursor.record(vertices, *next, take, |place| columns.contains(&place))?;
        *next += 1;
        Ok(())
    }
}
