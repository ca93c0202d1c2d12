//! Lists of points and lists of values, read into a flat buffer.

use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Unexpected, Visitor};

/// Name of the type [`ValueLists`], by which a service tells that a member is such a list.
pub const VALUE_LISTS: &str = "ValueLists";

/// Points as received, in a flat buffer. Rows may differ in length, and the first that does is recorded.
#[derive(Debug, Clone, Default)]
pub struct Points {
    pub coordinates: Vec<f64>,
    pub dimension: usize,
    pub n_rows: usize,
    /// Index and length of the first row that differs in length from row 0. From this row on, no coordinates
    /// are kept.
    pub ragged: Option<(usize, usize)>,
}

impl<'de> Deserialize<'de> for Points {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(PointsVisitor {
            what: "a list of points",
            row: "a point: a list of coordinates",
        })
    }
}

/// Lists of values, each with a value per point of a cloud. Stored like points, with a list as a row.
#[derive(Debug, Clone, Default)]
pub struct ValueLists(pub Points);

impl<'de> Deserialize<'de> for ValueLists {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let visitor = PointsVisitor { what: "a list of lists of values", row: "a list of values" };
        deserializer.deserialize_newtype_struct(VALUE_LISTS, visitor).map(Self)
    }
}

/// Builds [`Points`]. The fields describe the expected list and row in errors.
struct PointsVisitor {
    what: &'static str,
    row: &'static str,
}

impl<'de> Visitor<'de> for PointsVisitor {
    type Value = Points;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.what)
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(self, deserializer: D) -> Result<Points, D::Error> {
        deserializer.deserialize_seq(self)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut rows: A) -> Result<Points, A::Error> {
        let mut points = Points::default();
        // If the length is known, memory is reserved at once, so that a million points are not copied while
        // the buffer grows. Every size hint is bounded by the bytes of the body.
        let n_more = rows.size_hint().unwrap_or(0).saturating_sub(1);
        loop {
            let start = points.coordinates.len();
            if rows.next_element_seed(Row(&mut points.coordinates, self.row))?.is_none() {
                return Ok(points);
            }
            let length = points.coordinates.len() - start;
            if points.n_rows == 0 {
                points.dimension = length;
                points.coordinates.reserve_exact(n_more.saturating_mul(length));
            }
            if points.ragged.is_some() || length != points.dimension {
                points.ragged = points.ragged.or(Some((points.n_rows, length)));
                points.coordinates.truncate(start);
            }
            points.n_rows += 1;
        }
    }
}

/// Appends the coordinates of a row to the buffer.
struct Row<'a>(&'a mut Vec<f64>, &'static str);

impl<'de> serde::de::DeserializeSeed<'de> for Row<'_> {
    type Value = ();

    /// Asks for bytes, so that a format may give all coordinates in one piece.
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_bytes(self)
    }
}

impl<'de> Visitor<'de> for Row<'_> {
    type Value = ();

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.1)
    }

    fn visit_bytes<E: Error>(self, coordinates: &[u8]) -> Result<(), E> {
        let coordinates = bytemuck::try_cast_slice(coordinates);
        self.0.extend_from_slice(coordinates.map_err(|_| E::invalid_type(Unexpected::Seq, &self.1))?);
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut coordinates: A) -> Result<(), A::Error> {
        while let Some(x) = coordinates.next_element()? {
            self.0.push(x);
        }
        Ok(())
    }
}
