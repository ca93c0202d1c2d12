//! Numeric arrays of an answer: a flat buffer, written as nested JSON arrays or as raw bytes.

use std::ops::Range;

use bytes::Bytes;
use rayon::prelude::*;

/// Numbers that a thread checks at a time.
const NUMBERS_PER_TASK: usize = 1 << 16;

/// Bytes of a number in JSON with sign, 17 digits, a small exponent and a comma. Few numbers take more.
const BYTES_PER_NUMBER: usize = 24;

/// A row-major array of rank 1 or more, in which whole entries along one axis may be null.
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
    /// Wraps `data`, whose length is the product of the shape.
    pub fn new(data: Vec<f64>, shape: &[usize]) -> Self {
        debug_assert!(!shape.is_empty() && data.len() == shape.iter().product::<usize>());
        Self { data, shape: shape.to_vec(), nulls: None }
    }

    /// Marks entries of an axis as null.
    pub fn with_nulls(mut self, axis: usize, is_null: &[bool]) -> Self {
        debug_assert_eq!(is_null.len(), self.shape[axis]);
        if is_null.contains(&true) {
            self.nulls = Some(Nulls { axis, is_null: is_null.to_vec() });
        }
        self
    }

    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// A component of an entry of the first axis, NaN under a null.
    pub fn row_entry(&self, row: usize, component: usize) -> f64 {
        let block = self.block(0);
        let is_null = self.nulls.as_ref().is_some_and(|nulls| nulls.axis == 0 && nulls.is_null[row]);
        if is_null { f64::NAN } else { self.data[row * block + component] }
    }

    /// Number of numbers, including those under nulls.
    pub fn n_numbers(&self) -> usize {
        self.data.len()
    }

    /// Whether every number that is not under a null is finite, as JSON requires. Uses all threads of the
    /// current pool, unless there are nulls.
    pub fn is_finite(&self) -> bool {
        // No branches, so that the loop is vectorised.
        let finite = |numbers: &[f64]| numbers.iter().fold(true, |all, x| all & x.is_finite());
        match &self.nulls {
            None => self.data.par_chunks(NUMBERS_PER_TASK).all(finite),
            Some(nulls) => {
                let block = self.block(nulls.axis).max(1);
                let mut entries = self.data.chunks(block).zip(nulls.is_null.iter().cycle());
                entries.all(|(numbers, is_null)| *is_null || finite(numbers))
            }
        }
    }

    /// Returns the numbers as little-endian float64 without copying them. Numbers under nulls become NaN.
    pub fn into_bytes(mut self) -> Bytes {
        if let Some(nulls) = self.nulls.take() {
            let block = self.block(nulls.axis).max(1);
            let entries = self.data.chunks_mut(block).zip(nulls.is_null.iter().cycle());
            entries.filter(|(_, is_null)| **is_null).for_each(|(numbers, _)| numbers.fill(f64::NAN));
        }
        if cfg!(target_endian = "big") {
            self.data.iter_mut().for_each(|x| *x = f64::from_bits(x.to_bits().to_le()));
        }
        Bytes::from_owner(Raw(self.data))
    }

    /// Appends the part of the JSON text that belongs to a range of the numbers.
    ///
    /// The texts of consecutive ranges concatenate to the text of the whole, such as `[[1.0,2.0],null]`. Each
    /// number has the shortest form that reads back to the same bits.
    pub fn write_json(&self, range: Range<usize>, out: &mut Vec<u8>) {
        if self.data.is_empty() {
            return write_empty(&self.shape, out);
        }
        out.reserve(range.len() * BYTES_PER_NUMBER);
        // Numbers written in one go: all rows of a parent, or a single row where the next may be null.
        let rank = self.shape.len();
        let run = if self.nulls.is_none() && rank >= 2 {
            self.block(rank - 2) * self.shape[rank - 2]
        } else {
            self.row()
        };
        let mut at = range.start;
        while at < range.end {
            if let Some(entry) = self.null_entry(at) {
                // A null entry that began before the range has been written already.
                if entry.start == at {
                    self.write_brackets(at, out);
                    out.extend_from_slice(b"null");
                }
                at = entry.end;
            } else {
                let end = range.end.min(at - at % run + run);
                self.write_brackets(at, out);
                self.write_run(at..end, out);
                at = end;
            }
        }
        if range.end == self.data.len() {
            out.extend((0..self.depth(range.end - 1)).map(|_| b']'));
        }
    }

    /// Writes numbers of consecutive rows. The first and the last row may be partial.
    fn write_run(&self, range: Range<usize>, out: &mut Vec<u8>) {
        let row = self.row();
        let mut at = range.start;
        while at < range.end {
            if at > range.start {
                out.extend_from_slice(b"],[");
            }
            let end = range.end.min(at - at % row + row);
            match self.nulls.as_ref().filter(|nulls| nulls.axis + 1 == self.shape.len()) {
                None => write_numbers(&self.data[at..end], |_| false, out),
                Some(nulls) => {
                    write_numbers(&self.data[at..end], |index| nulls.is_null[(at + index) % row], out);
                }
            }
            at = end;
        }
    }

    /// Length of an innermost row.
    fn row(&self) -> usize {
        self.shape.last().copied().unwrap_or(1)
    }

    /// Writes the text between a number and its predecessor: closing brackets, a comma, opening brackets.
    fn write_brackets(&self, at: usize, out: &mut Vec<u8>) {
        if at == 0 {
            out.extend((0..self.depth(at)).map(|_| b'['));
            return;
        }
        // An entry begins here on this axis and all inner ones. Brackets up to this axis stay open.
        let axis = (0..self.shape.len()).find(|&axis| at.is_multiple_of(self.block(axis)));
        let open = axis.map_or(self.shape.len(), |axis| axis + 1);
        out.extend((open..self.depth(at - 1)).map(|_| b']'));
        out.push(b',');
        out.extend((open..self.depth(at)).map(|_| b'['));
    }

    /// Number of brackets open around a number, or around the null in its place.
    fn depth(&self, at: usize) -> usize {
        match (&self.nulls, self.null_entry(at)) {
            (Some(nulls), Some(_)) => nulls.axis + 1,
            _ => self.shape.len(),
        }
    }

    /// The range of the null entry that contains a number. `None` if nulls are single numbers, on the
    /// innermost axis.
    fn null_entry(&self, at: usize) -> Option<Range<usize>> {
        let nulls = self.nulls.as_ref().filter(|nulls| nulls.axis + 1 < self.shape.len())?;
        let block = self.block(nulls.axis);
        let start = at - at % block;
        nulls.is_null[start / block % self.shape[nulls.axis]].then_some(start..start + block)
    }

    /// Numbers per entry along an axis.
    fn block(&self, axis: usize) -> usize {
        self.shape[axis + 1..].iter().product()
    }
}

/// Writes numbers or nulls, separated by commas.
fn write_numbers(numbers: &[f64], is_null: impl Fn(usize) -> bool, out: &mut Vec<u8>) {
    for (index, &x) in numbers.iter().enumerate() {
        if is_null(index) {
            out.extend_from_slice(b"null");
        } else {
            // A new buffer per number: with a shared buffer the loop takes 1.5 times as long.
            out.extend_from_slice(zmij::Buffer::new().format_finite(x).as_bytes());
        }
        out.push(b',');
    }
    out.pop();
}

/// Writes an array that has no numbers.
fn write_empty(shape: &[usize], out: &mut Vec<u8>) {
    let Some((&length, rest)) = shape.split_first() else { return };
    out.push(b'[');
    for index in 0..length {
        if index > 0 {
            out.push(b',');
        }
        write_empty(rest, out);
    }
    out.push(b']');
}

/// Owns numbers and exposes their bytes.
struct Raw(Vec<f64>);

impl AsRef<[u8]> for Raw {
    fn as_ref(&self) -> &[u8] {
        bytemuck::cast_slice(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::Value;

    use super::*;

    fn json(array: &Array) -> String {
        let mut out = Vec::new();
        array.write_json(0..array.n_numbers(), &mut out);
        String::from_utf8(out).unwrap()
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
        assert_eq!(json(&Array::new(vec![], &[0, 2])), "[]");
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
    fn numbers_under_nulls_may_be_anything_and_others_must_be_finite() {
        assert!(!Array::new(vec![1.0, f64::NAN], &[2]).is_finite());
        assert!(!Array::new(vec![1.0, f64::INFINITY], &[2]).with_nulls(0, &[true, false]).is_finite());
        let hidden = Array::new(vec![1.0, f64::NAN], &[2]).with_nulls(0, &[false, true]);
        assert!(hidden.is_finite());
        assert_eq!(json(&hidden), "[1.0,null]");
    }

    #[test]
    fn bytes_are_little_endian_with_nan_for_null() {
        let array = Array::new((0..8).map(f64::from).collect(), &[2, 2, 2]).with_nulls(1, &[true, false]);
        let bytes = array.into_bytes();
        let numbers: Vec<f64> =
            bytes.chunks(8).map(|chunk| f64::from_le_bytes(chunk.try_into().unwrap())).collect();
        assert!([0, 1, 4, 5].iter().all(|&at: &usize| numbers[at].is_nan()));
        assert_eq!([numbers[2], numbers[3], numbers[6], numbers[7]], [2.0, 3.0, 6.0, 7.0]);
    }

    /// Builds the array as a `serde_json` value, for comparison.
    fn nested(data: &[f64], shape: &[usize], axis: usize, nulls: Option<(usize, &[bool])>) -> Value {
        let Some((&length, rest)) = shape.split_first() else { return data[0].into() };
        let block = data.len() / length;
        let entry = |index: usize| match nulls {
            Some((null_axis, is_null)) if null_axis == axis && is_null[index] => Value::Null,
            _ => nested(&data[index * block..][..block], rest, axis + 1, nulls),
        };
        (0..length).map(entry).collect()
    }

    proptest! {
        #[test]
        fn the_texts_of_ranges_make_the_text_of_all(
            shape in proptest::collection::vec(1_usize..5, 1..4),
            axis in 0_usize..3,
            pattern in any::<u8>(),
            cuts in proptest::collection::vec(0_usize..64, 0..4),
            bits in proptest::collection::vec(any::<u64>(), 64),
        ) {
            let n: usize = shape.iter().product();
            let finite = |bits: u64| Some(f64::from_bits(bits)).filter(|x| x.is_finite()).unwrap_or(0.1);
            let data: Vec<f64> = bits[..n].iter().map(|&bits| finite(bits)).collect();
            let axis = axis % shape.len();
            let is_null: Vec<bool> = (0..shape[axis]).map(|index| pattern >> index & 1 == 1).collect();
            let array = Array::new(data.clone(), &shape).with_nulls(axis, &is_null);
            let mut cuts: Vec<usize> = cuts.into_iter().map(|cut| cut.min(n)).chain([0, n]).collect();
            cuts.sort_unstable();
            let mut text = Vec::new();
            cuts.windows(2).filter(|cut| cut[0] < cut[1]).for_each(|cut| array.write_json(cut[0]..cut[1], &mut text));
            let text = String::from_utf8(text).unwrap();
            prop_assert_eq!(&text, &json(&array));
            let expected = nested(&data, &shape, 0, Some((axis, &is_null)));
            prop_assert_eq!(serde_json::from_str::<Value>(&text).unwrap(), expected);
        }
    }

    #[test]
    fn numbers_are_written_to_the_last_bit() {
        let x = [0.1 + 0.2, 1e-310, f64::MAX, -0.0, 5e-324, 1e16, 1e-5, 123_456_789.0];
        let parsed: Vec<f64> = serde_json::from_str(&json(&Array::new(x.to_vec(), &[8]))).unwrap();
        assert!(parsed.iter().zip(&x).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}
