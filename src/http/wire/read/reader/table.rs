//! Numbers of a request that are not in its text.

use crate::http::problem::Problem;
use crate::http::wire::read::ply::Rows;
use crate::http::wire::read::tensors::Tensor;

/// Numbers in the bytes of a body: a list of them, or a list of rows.
pub(in crate::http::wire::read) enum Table<'a> {
    Tensor(Tensor<'a>),
    Vertices(Rows<'a>),
    /// Numbers that no member accepts, with the reason.
    Refused(String),
}

impl Table<'_> {
    /// Entries of the list.
    pub(super) fn length(&self) -> usize {
        match self {
            Self::Tensor(tensor) => tensor.length,
            Self::Vertices(rows) => rows.length(),
            Self::Refused(_) => 0,
        }
    }

    /// Numbers per row, or `None` for a list of numbers.
    pub(super) fn width(&self) -> Option<usize> {
        match self {
            Self::Tensor(tensor) => tensor.width,
            Self::Vertices(_) => Some(Rows::WIDTH),
            Self::Refused(_) => None,
        }
    }

    /// Reads a number. Rows are read in their order, each from its first column on.
    ///
    /// # Errors
    /// Returns the problem of a body that turns out to be malformed here.
    #[inline]
    pub(super) fn number(&mut self, row: usize, column: usize) -> Result<f64, Box<Problem>> {
        match self {
            Self::Tensor(tensor) => Ok(tensor.number(row, column)),
            Self::Vertices(rows) => rows.number(row, column),
            Self::Refused(_) => Ok(f64::NAN),
        }
    }
}

/// A table and the names of the members that lead to it, at least one.
pub(in crate::http::wire::read) struct Named<'a> {
    pub(super) path: Vec<String>,
    pub(super) table: Table<'a>,
    /// Names of the path that the reader has come to.
    n_reached: usize,
}

impl<'a> Named<'a> {
    pub(in crate::http::wire::read) fn new(path: Vec<String>, table: Table<'a>) -> Self {
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
