//! `NumPy` arrays, with a strict parser for their header.
//!
//! A crate was tried and rejected: its parser recurses on brackets sent by the client and multiplies shapes
//! unchecked.

use super::tensor::{Layout, Tensor};
use crate::wire::read::reader::Given;

/// Highest rank of an array, the limit of `NumPy` itself.
const MAX_RANK: usize = 64;

/// The header and the numbers of a `NumPy` array (NumPy Enhancement Proposal 1).
///
/// The layout is: magic, version, length of the header, a Python dictionary with `descr`, `fortran_order` and
/// `shape`, then the numbers.
pub struct Npy<'a> {
    pub descr: &'a str,
    pub fortran_order: bool,
    pub shape: Vec<usize>,
    pub data: &'a [u8],
}

impl<'a> Npy<'a> {
    /// Returns `None` if the bytes are not npy, or if the header exceeds `max_header_bytes`.
    pub fn parse(bytes: &'a [u8], max_header_bytes: usize) -> Option<Self> {
        let (version, rest) = bytes.strip_prefix(b"\x93NUMPY")?.split_at_checked(2)?;
        let (n_header, rest) = match version[0] {
            1 => rest.split_first_chunk().map(|(&n, rest)| (u16::from_le_bytes(n).into(), rest))?,
            2 | 3 => rest.split_first_chunk().map(|(&n, rest)| (u32::from_le_bytes(n), rest))?,
            _ => return None,
        };
        let n_header = usize::try_from(n_header).ok().filter(|&length| length <= max_header_bytes)?;
        let (header, data) = rest.split_at_checked(n_header)?;
        let header = str::from_utf8(header).ok()?;
        let value = |name| Some(header.split_once(name)?.1.trim_start().strip_prefix(':')?.trim_start());
        let descr = value("'descr'")?;
        let descr = match descr.strip_prefix('\'') {
            Some(quoted) => quoted.split_once('\'')?.0,
            None => "of several fields",
        };
        let fortran_order = match value("'fortran_order'")? {
            text if text.starts_with("True") => true,
            text if text.starts_with("False") => false,
            _ => return None,
        };
        let shape = value("'shape'")?.strip_prefix('(')?.split_once(')')?.0;
        let lengths = shape.split(',').map(str::trim).filter(|length| !length.is_empty());
        let shape = lengths.take(MAX_RANK + 1).map(|length| length.parse().ok());
        let shape = shape.collect::<Option<Vec<_>>>().filter(|shape| shape.len() <= MAX_RANK)?;
        Some(Self { descr, fortran_order, shape, data })
    }

    /// Returns `None` if the number of bytes differs from what the header says.
    pub(super) fn into_table(self) -> Option<Given<'a>> {
        let (width, is_big_endian) = match self.descr {
            "<f8" => (8, false),
            ">f8" => (8, true),
            "<f4" => (4, false),
            ">f4" => (4, true),
            other => {
                return Some(Err(format!("the array has dtype {other:?}, not '<f8' or '<f4'")));
            }
        };
        let n_bytes = self.shape.iter().try_fold(width, |n: usize, &length| n.checked_mul(length))?;
        let is_transposed = self.fortran_order && self.shape.len() > 1;
        (n_bytes == self.data.len())
            .then(|| Tensor::of(self.data, &self.shape, Layout { width, is_big_endian, is_transposed }))
    }
}
