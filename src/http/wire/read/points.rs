//! Lists of points, read into one flat buffer.

use serde::de::{Deserialize, Deserializer, SeqAccess, Visitor};

/// Points as they come: one flat buffer, whatever their number, with the first row that differs in length.
#[derive(Debug, Clone, Default)]
pub struct Points {
    pub coordinates: Vec<f64>,
    pub dimension: usize,
    pub n_rows: usize,
    /// Index and length of the first ragged row, behind which nothing is kept.
    pub ragged: Option<(usize, usize)>,
}

impl<'de> Deserialize<'de> for Points {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(PointsVisitor)
    }
}

struct PointsVisitor;

impl<'de> Visitor<'de> for PointsVisitor {
    type Value = Points;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a list of points")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut rows: A) -> Result<Points, A::Error> {
        let mut points = Points::default();
        // Room is made at once where the length is known, so that a million points are not copied while their list grows. Every
        // hint is bounded by the bytes that are there.
        let n_more = rows.size_hint().unwrap_or(0).saturating_sub(1);
        loop {
            let start = points.coordinates.len();
            if rows.next_element_seed(Row(&mut points.coordinates))?.is_none() {
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

/// Appends one row.
struct Row<'a>(&'a mut Vec<f64>);

impl<'de> serde::de::DeserializeSeed<'de> for Row<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for Row<'_> {
    type Value = ();

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a point: a list of coordinates")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut coordinates: A) -> Result<(), A::Error> {
        while let Some(x) = coordinates.next_element()? {
            self.0.push(x);
        }
        Ok(())
    }
}
