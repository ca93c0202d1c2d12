//! Deserializer for members of requests that are lists and count as absent when they are empty.

use serde::de::{Deserialize, Deserializer};

use super::points::Points;

/// Lists that count as absent when they are empty.
pub trait List {
    fn is_empty(&self) -> bool;
}

impl List for Vec<f64> {
    fn is_empty(&self) -> bool {
        self.as_slice().is_empty()
    }
}

impl List for Points {
    fn is_empty(&self) -> bool {
        self.n_rows == 0
    }
}

/// Deserializes an optional list, where an empty list counts as absent.
///
/// Meant for lists that make no sense when empty: generated clients send `[]` for what their user left out.
///
/// # Errors
/// Returns the errors of the type.
pub fn present_unless_empty<'de, T, D>(deserializer: D) -> Result<Option<T>, D::Error>
where
    T: Deserialize<'de> + List,
    D: Deserializer<'de>,
{
    T::deserialize(deserializer).map(|list| Some(list).filter(|list| !list.is_empty()))
}
