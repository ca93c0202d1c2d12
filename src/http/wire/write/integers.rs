//! Integer lists of an answer, such as the indices of sparse matrices.

use bytes::Bytes;
use serde::Serialize;

/// A list of integers: JSON numbers without a point, or an I64 tensor.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct Integers(Vec<i64>);

impl Integers {
    pub fn new(numbers: Vec<i64>) -> Self {
        Self(numbers)
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the numbers as little-endian int64.
    pub fn into_bytes(mut self) -> Bytes {
        if cfg!(target_endian = "big") {
            self.0.iter_mut().for_each(|x| *x = x.to_le());
        }
        Bytes::from_owner(Raw(self.0))
    }
}

/// Owns integers and exposes their bytes.
struct Raw(Vec<i64>);

impl AsRef<[u8]> for Raw {
    fn as_ref(&self) -> &[u8] {
        bytemuck::cast_slice(&self.0)
    }
}
