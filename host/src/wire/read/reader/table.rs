//! Numbers of a request that are not in its text.

use crate::problem::Problem;

/// Numbers that are read from a table at a time.
const NUMBERS_PER_BLOCK: usize = 64;

/// Numbers in the bytes of a body: a list of them, or a list of rows.
pub trait Table {
    /// Entries of the list.
    fn length(&self) -> usize;

    /// Numbers per row, or `None` for a list of numbers.
    fn width(&self) -> Option<usize>;

    /// Reads numbers from an index on, row by row. Returns how many they are, none after the last one.
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
pub struct NamedTable<'a> {
    pub(super) path: Vec<String>,
    pub(super) table: Given<'a>,
    /// Names of the path that the reader has come to.
    n_reached: usize,
}

impl<'a> NamedTable<'a> {
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

/// Consecutive numbers of a table, read one by one.
pub(super) struct Block {
    numbers: [f64; NUMBERS_PER_BLOCK],
    length: usize,
    next: usize,
    /// Numbers of the table before this block.
    n_before: usize,
}

impl Block {
    pub(super) const EMPTY: Self =
        Self { numbers: [0.0; NUMBERS_PER_BLOCK], length: 0, next: 0, n_before: 0 };

    /// The next number, unless the block is used up.
    #[inline]
    pub(super) fn next(&mut self) -> Option<f64> {
        let x = self.numbers[..self.length].get(self.next).copied();
        self.next += usize::from(x.is_some());
        x
    }

    /// Goes on to the next numbers of the table.
    ///
    /// # Errors
    /// Returns the error of the table.
    pub(super) fn fill(&mut self, table: &mut dyn Table) -> Result<(), Box<Problem>> {
        self.n_before += self.length;
        (self.length, self.next) = (0, 0);
        self.length = table.read(self.n_before, &mut self.numbers)?;
        Ok(())
    }
}
