//! Three properties of every vertex, deserialized as a list of rows.

use std::cell::Cell;

use serde::de::{DeserializeSeed, Deserializer, Error as _, IntoDeserializer, SeqAccess, Visitor};
use serde::forward_to_deserialize_any;
use serde_json::Error;

use super::PlyError;
use super::data::Cursor;
use super::header::Element;

/// A list of rows in the data of a file.
pub(super) struct Rows<'a> {
    cursor: Cursor<'a>,
    vertices: &'a Element<'a>,
    columns: [usize; 3],
    next: usize,
    /// Receives the reason why the file cannot be read, because errors of serde cannot carry it.
    failure: &'a Cell<Option<PlyError>>,
}

impl<'a> Rows<'a> {
    pub(super) fn new(
        cursor: Cursor<'a>,
        vertices: &'a Element<'a>,
        columns: [usize; 3],
        failure: &'a Cell<Option<PlyError>>,
    ) -> Self {
        Self { cursor, vertices, columns, next: 0, failure }
    }

    fn row(&mut self) -> Result<[f64; 3], PlyError> {
        let (mut row, columns) = ([0.0; 3], self.columns);
        let take = |place, x| {
            if let Some(axis) = columns.iter().position(|&column| column == place) {
                row[axis] = x;
            }
        };
        self.cursor.record(self.vertices, self.next, take, |place| columns.contains(&place))?;
        Ok(row)
    }
}

impl<'de> SeqAccess<'de> for Rows<'_> {
    type Error = Error;

    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, Error> {
        if self.next == self.vertices.count {
            return Ok(None);
        }
        let row = self.row().map_err(|failure| {
            self.failure.set(Some(failure));
            Error::custom("the file ends here")
        })?;
        self.next += 1;
        seed.deserialize(Row { row, next: 0 }).map(Some)
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.vertices.count - self.next)
    }
}

impl<'de> IntoDeserializer<'de, Error> for Rows<'_> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

/// A list of three numbers.
struct Row {
    row: [f64; 3],
    next: usize,
}

impl<'de> SeqAccess<'de> for Row {
    type Error = Error;

    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, Error> {
        let Some(&x) = self.row.get(self.next) else { return Ok(None) };
        self.next += 1;
        seed.deserialize(Coordinate(x)).map(Some)
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.row.len() - self.next)
    }
}

/// A number. A value that is not finite is refused here, where the guard can add its path to the error.
struct Coordinate(f64);

impl<'de> Deserializer<'de> for Coordinate {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        let Self(x) = self;
        if x.is_finite() { visitor.visit_f64(x) } else { Err(Error::custom(format!("{x} is not finite"))) }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map struct enum identifier ignored_any
    }
}

/// Implements a deserializer that is always a list, whatever type is requested.
macro_rules! deserialize_as_list {
    ($name:ty) => {
        impl<'de> Deserializer<'de> for $name {
            type Error = Error;

            fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
                visitor.visit_seq(self)
            }

            forward_to_deserialize_any! {
                bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit
                unit_struct newtype_struct seq tuple tuple_struct map struct enum identifier ignored_any
            }
        }
    };
}
deserialize_as_list!(Rows<'_>);
deserialize_as_list!(Row);
