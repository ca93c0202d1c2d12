//! Three properties of every vertex, as the rows of a table.

use super::data::Cursor;
use super::header::Element;
use super::{PlyError, malformed};
use crate::problem::Problem;
use crate::wire::read::reader::Table;

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

    fn row(&mut self, index: usize, row: &mut [f64]) -> Result<(), PlyError> {
        let Self { cursor, vertices, columns } = self;
        let take = |place, x| {
            if let Some(axis) = columns.iter().position(|&column| column == place) {
                row[axis] = x;
            }
        };
        cursor.record(vertices, index, take, |place| columns.contains(&place))
    }
}

impl Table for Rows<'_> {
    fn length(&self) -> usize {
        self.vertices.count
    }

    fn width(&self) -> Option<usize> {
        Some(WIDTH)
    }

    /// Reads whole rows up to the first that is malformed. That row is refused once it is the next one to be
    /// read, so that numbers before it are refused first.
    fn read(&mut self, index: usize, numbers: &mut [f64]) -> Result<usize, Box<Problem>> {
        let (mut n_read, indices) = (0, index / WIDTH..self.vertices.count);
        for (row, index) in numbers.chunks_exact_mut(WIDTH).zip(indices) {
            let cursor = self.cursor;
            match self.row(index, row) {
                Ok(()) => n_read += WIDTH,
                Err(error) if n_read == 0 => return Err(Box::new(malformed(error))),
                Err(_) => {
                    self.cursor = cursor;
                    break;
                }
            }
        }
        Ok(n_read)
    }
}
