//! Numbers of a request that are not in its text.

use crate::http::problem::Problem;

/// Numbers that are read from a table at a time.
const NUMBERS_PER_BLOCK: usize = 64;

/// Numbers in the bytes of a body: a list of them, or a list of rows.
pub trait Table {
    /// Entries of the list.
    fn length(&self) -> usize;

    /// Numbers per row, or `None` for a list of numbers.
    fn width(&self) -> Option<usize>;

    /// Reads numbers from an index on, row by row. Returns how many they are, at least one.
    ///
    /// The index is 0, or follows the last number that was read.
    ///
    /// # Errors
    /// Returns the problem of a body that turns out to be malformed here.
    fn read(&mut self, index: usize, numbers: &mut [f64]) -> Result<usize, Box<Problem>>;
}

/// A table, or the reason why no member accepts it.
pub type Given<'a> = Result<Box<dyn Table + 'a>, String>;

/// A table and the names of the members that lead to it, at least one.
pub struct Named<'a> {
    pub(super) path: Vec<String>,
    pub(super) table: Given<'a>,
    /// Names of the path that the reader has come to.
    n_reached: usize,
}

impl<'a> Named<'a> {
    pub fn new(path: Vec<String>, table: Given<'a>) -> Self {
        Self { path, table, n_reached: 0 }
    }

    /// The name at this depth, unless the reader was there before.
    pub(super) fn name_at(&self, depth: usize) -> Option<&str> {
        self.path.get(depth).filter(|_| self.n_reached == depth).map(String::as_str)
    }

    /// Marks the next name as reached.
    pub(super) fn reach(&mut self) {
        self.n_reached += 1;
    }
}

/// A list in a table: all of it, or a row.
#[derive(Clone, Copy)]
pub(super) struct Cells {
    /// Index of the table.
    pub(super) table: usize,
    /// Index of the first number.
    pub(super) start: usize,
    /// Entries of the list.
    pub(super) length: usize,
    /// Numbers per entry, or `None` for a list of numbers.
    pub(super) width: Option<usize>,
}

impl Cells {
    /// The row at an index, if this is a list of rows.
    pub(super) fn row(self, index: usize) -> Option<Self> {
        let length = self.width?;
        Some(Self { start: self.start + index * length, length, width: None, ..self })
    }
}

/// Consecutive numbers of a table.
pub(super) struct Block {
    pub(super) start: usize,
    pub(super) length: usize,
    pub(super) numbers: [f64; NUMBERS_PER_BLOCK],
}

impl Block {
    pub(super) const EMPTY: Self = Self { start: 0, length: 0, numbers: [0.0; NUMBERS_PER_BLOCK] };

    /// The number at an index of the table, if the block has it.
    #[inline]
    pub(super) fn get(&self, index: usize) -> Option<f64> {
        self.numbers[..self.length].get(index.wrapping_sub(self.start)).copied()
    }
}
