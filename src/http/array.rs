//! Numbers of an answer: one flat buffer, written as nested JSON arrays.

use serde::ser::{Error, Serialize, SerializeSeq, Serializer};

/// A row-major array of any rank in which whole entries along one axis may be null.
#[derive(Debug, Clone)]
pub struct Array {
    data: Vec<f64>,
    shape: Vec<usize>,
    nulls: Option<Nulls>,
}

#[derive(Debug, Clone)]
struct Nulls {
    axis: usize,
    is_null: Vec<bool>,
}

impl Array {
    /// `data` has as many numbers as the product of the shape.
    pub fn new(data: Vec<f64>, shape: &[usize]) -> Self {
        debug_assert_eq!(data.len(), shape.iter().product::<usize>());
        Self { data, shape: shape.to_vec(), nulls: None }
    }

    /// Answers null for the entries of an axis where `is_null`.
    pub fn with_nulls(mut self, axis: usize, is_null: &[bool]) -> Self {
        debug_assert_eq!(is_null.len(), self.shape[axis]);
        if is_null.contains(&true) {
            self.nulls = Some(Nulls { axis, is_null: is_null.to_vec() });
        }
        self
    }
}

impl Serialize for Array {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        View { data: &self.data, shape: &self.shape, axis: 0, nulls: self.nulls.as_ref() }
            .serialize(serializer)
    }
}

/// For single numbers of an answer: what JSON cannot say is an error, not a silent null.
///
/// # Errors
/// For NaN and infinities.
pub fn finite<S: Serializer>(x: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    if x.is_finite() { serializer.serialize_f64(*x) } else { Err(S::Error::custom("a number is not finite")) }
}

/// [`finite`] for optional fields that are present.
///
/// # Errors
/// For NaN and infinities.
pub fn finite_if_present<S: Serializer>(x: &Option<f64>, serializer: S) -> Result<S::Ok, S::Error> {
    match x {
        Some(x) => finite(x, serializer),
        None => serializer.serialize_none(),
    }
}

/// The part of an array below some indices.
struct View<'a> {
    data: &'a [f64],
    shape: &'a [usize],
    axis: usize,
    nulls: Option<&'a Nulls>,
}

impl Serialize for View<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Some((&length, rest)) = self.shape.split_first() else {
            return self.data.first().serialize(serializer);
        };
        let stride: usize = rest.iter().product();
        let mut sequence = serializer.serialize_seq(Some(length))?;
        for index in 0..length {
            let is_null = self.nulls.is_some_and(|nulls| nulls.axis == self.axis && nulls.is_null[index]);
            let data = &self.data[index * stride..][..stride];
            match (is_null, rest.is_empty()) {
                (true, _) => sequence.serialize_element(&())?,
                // JSON has no such number, and serde_json would write null in silence.
                (false, true) if !data[0].is_finite() => {
                    return Err(S::Error::custom("a number is not finite"));
                }
                (false, true) => sequence.serialize_element(&data[0])?,
                (false, false) => sequence.serialize_element(&View {
                    data,
                    shape: rest,
                    axis: self.axis + 1,
                    nulls: self.nulls,
                })?,
            }
        }
        sequence.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn json(array: &Array) -> String {
        serde_json::to_string(array).unwrap()
    }

    #[test]
    fn arrays_nest_by_their_shape() {
        assert_eq!(json(&Array::new(vec![1.0, 2.5], &[2])), "[1.0,2.5]");
        assert_eq!(
            json(&Array::new((0..6).map(f64::from).collect(), &[3, 2])),
            "[[0.0,1.0],[2.0,3.0],[4.0,5.0]]"
        );
        assert_eq!(json(&Array::new((0..4).map(f64::from).collect(), &[1, 2, 2])), "[[[0.0,1.0],[2.0,3.0]]]");
        assert_eq!(json(&Array::new(vec![], &[2, 0])), "[[],[]]");
    }

    #[test]
    fn whole_entries_are_null_along_their_axis() {
        let scalars = Array::new(vec![1.0, 2.0], &[2]).with_nulls(0, &[true, false]);
        assert_eq!(json(&scalars), "[null,2.0]");
        let rows = Array::new((0..4).map(f64::from).collect(), &[2, 2]).with_nulls(0, &[false, true]);
        assert_eq!(json(&rows), "[[0.0,1.0],null]");
        let matrices = Array::new((0..8).map(f64::from).collect(), &[2, 2, 2]).with_nulls(1, &[true, false]);
        assert_eq!(json(&matrices), "[[null,[2.0,3.0]],[null,[6.0,7.0]]]");
    }

    #[test]
    fn what_json_cannot_say_is_an_error() {
        assert!(serde_json::to_string(&Array::new(vec![1.0, f64::NAN], &[2])).is_err());
        let hidden = Array::new(vec![1.0, f64::NAN], &[2]).with_nulls(0, &[false, true]);
        assert_eq!(json(&hidden), "[1.0,null]");
    }

    #[test]
    fn numbers_are_written_to_the_last_bit() {
        let x = [0.1 + 0.2, 1e-310, f64::MAX, -0.0];
        let parsed: Vec<f64> = serde_json::from_str(&json(&Array::new(x.to_vec(), &[4]))).unwrap();
        assert!(parsed.iter().zip(&x).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}
