//! Whole numbers of an answer: indices, of which sparse matrices have many.

use bytes::Bytes;
use serde::Serialize;

/// A list of whole numbers: JSON numbers without a point, or an I64 tensor.
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

    /// The numbers as little-endian int64.
    pub fn into_bytes(mut self) -> Bytes {
        if cfg!(target_endian = "big") {
            self.0.iter_mut().for_each(|x| *x = x.to_le());
        }
        Bytes::from_owner(Raw(self.0))
    }
}

/// The memory of a list, as bytes.
struct Raw(Vec<i64>);

impl AsRef<[u8]> for Raw {
    fn as_ref(&self) -> &[u8] {
        bytemuck::cast_slice(&self.0)
    }
}
