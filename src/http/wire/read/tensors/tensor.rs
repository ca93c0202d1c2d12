//! A tensor of a request, deserialized as a list of numbers or a list of rows.

use serde::de::{DeserializeSeed, Deserializer, Error as _, SeqAccess, Visitor};
use serde::forward_to_deserialize_any;
use serde_json::Error;

use safetensors::Dtype;
use safetensors::tensor::TensorView;

/// A member of a request that is a tensor.
pub(super) enum Node<'a> {
    Tensor(Tensor<'a>),
    /// A tensor that no member accepts, with the reason.
    Refused(String),
}

impl<'a> Node<'a> {
    pub(super) fn of(view: &TensorView<'a>) -> Self {
        let width = match view.dtype() {
            Dtype::F64 => 8,
            Dtype::F32 => 4,
            other => return Self::Refused(format!("the tensor has dtype {other:?}, not F64 or F32")),
        };
        Tensor::node(view.data(), view.shape(), Layout { width, is_big_endian: false, is_transposed: false })
    }
}

impl<'de> Deserializer<'de> for &Node<'_> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match self {
            Node::Tensor(tensor) => visitor.visit_seq(Rows { tensor, next: 0 }),
            Node::Refused(reason) => Err(Error::custom(reason)),
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map struct enum identifier ignored_any
    }
}

/// Numbers of shape `[n]` or `[n, d]` in the bytes of a request.
pub(super) struct Tensor<'a> {
    data: &'a [u8],
    n_rows: usize,
    /// Numbers per row, or `None` for a list of numbers.
    row: Option<usize>,
    layout: Layout,
}

#[derive(Clone, Copy)]
pub(super) struct Layout {
    /// Bytes per number.
    pub(super) width: usize,
    pub(super) is_big_endian: bool,
    /// Whether the numbers are stored column by column (Fortran order).
    pub(super) is_transposed: bool,
}

impl<'a> Tensor<'a> {
    pub(super) fn node(data: &'a [u8], shape: &[usize], layout: Layout) -> Node<'a> {
        match *shape {
            [n_rows] => Node::Tensor(Self { data, n_rows, row: None, layout }),
            // Rows of length 0 take no bytes, so their number would be unbounded.
            [n_rows, row] if row > 0 => Node::Tensor(Self { data, n_rows, row: Some(row), layout }),
            _ => Node::Refused(format!("the tensor has shape {shape:?}, not [n] or [n, d]")),
        }
    }

    /// Returns a number by row and column. float32 is widened exactly.
    fn number(&self, row: usize, column: usize) -> Result<f64, Error> {
        let Layout { width, is_big_endian, is_transposed } = self.layout;
        let at =
            if is_transposed { column * self.n_rows + row } else { row * self.row.unwrap_or(1) + column };
        let bytes = self.data.get(at * width..(at + 1) * width).unwrap_or_default();
        let x = match (<[u8; 8]>::try_from(bytes), <[u8; 4]>::try_from(bytes), is_big_endian) {
            (Ok(bytes), _, false) => f64::from_le_bytes(bytes),
            (Ok(bytes), _, true) => f64::from_be_bytes(bytes),
            (_, Ok(bytes), false) => f32::from_le_bytes(bytes).into(),
            (_, Ok(bytes), true) => f32::from_be_bytes(bytes).into(),
            (Err(_), Err(_), _) => return Err(Error::custom("the tensor ends early")),
        };
        if x.is_finite() { Ok(x) } else { Err(Error::custom(format!("{x} is not finite"))) }
    }
}

struct Rows<'t, 'a> {
    tensor: &'t Tensor<'a>,
    next: usize,
}

impl<'de> SeqAccess<'de> for Rows<'_, '_> {
    type Error = Error;

    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, Error> {
        if self.next == self.tensor.n_rows {
            return Ok(None);
        }
        self.next += 1;
        let (tensor, row) = (self.tensor, self.next - 1);
        match tensor.row {
            None => seed.deserialize(Entry(tensor, row, 0)).map(Some),
            Some(length) => seed.deserialize(Row { tensor, row, columns: 0..length }).map(Some),
        }
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.tensor.n_rows - self.next)
    }
}

struct Row<'t, 'a> {
    tensor: &'t Tensor<'a>,
    row: usize,
    columns: std::ops::Range<usize>,
}

impl<'de> SeqAccess<'de> for Row<'_, '_> {
    type Error = Error;

    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, Error> {
        let Some(column) = self.columns.next() else { return Ok(None) };
        seed.deserialize(Entry(self.tensor, self.row, column)).map(Some)
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.columns.len())
    }
}

impl<'de> Deserializer<'de> for Row<'_, '_> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_seq(self)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map struct enum identifier ignored_any
    }
}

/// A number at a row and column. It is read and refused lazily, where the guard can add its path to the
/// error.
struct Entry<'t, 'a>(&'t Tensor<'a>, usize, usize);

impl<'de> Deserializer<'de> for Entry<'_, '_> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_f64(self.0.number(self.1, self.2)?)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map struct enum identifier ignored_any
    }
}
