//! Integer lists of an answer, such as the indices of sparse matrices.

use bytes::Bytes;
use serde::{Serialize, Serializer};

/// A list of integers, or of rows of them: JSON numbers without a point, or an I64 tensor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Integers {
    numbers: Vec<i64>,
    /// Numbers per row. `None` for a plain list.
    width: Option<usize>,
}

impl Integers {
    pub fn new(numbers: Vec<i64>) -> Self {
        Self { numbers, width: None }
    }

    /// A list of rows of `width` numbers each.
    pub fn rows(numbers: Vec<i64>, width: usize) -> Self {
        debug_assert!(numbers.len().is_multiple_of(width));
        Self { numbers, width: Some(width) }
    }

    pub fn shape(&self) -> Vec<usize> {
        match self.width {
            None => vec![self.numbers.len()],
            Some(width) => vec![self.numbers.len() / width, width],
        }
    }

    /// Returns the numbers as little-endian int64.
    pub fn into_bytes(mut self) -> Bytes {
        if cfg!(target_endian = "big") {
            self.numbers.iter_mut().for_each(|x| *x = x.to_le());
        }
        Bytes::from_owner(Raw(self.numbers))
    }
}

impl Serialize for Integers {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.width {
            None => self.numbers.serialize(serializer),
            Some(width) => serializer.collect_seq(self.numbers.chunks_exact(width)),
        }
    }
}

/// Owns integers and exposes their bytes.
struct Raw(Vec<i64>);

impl AsRef<[u8]> for Raw {
    fn as_ref(&self) -> &[u8] {
        bytemuck::cast_slice(&self.0)
    }
}
