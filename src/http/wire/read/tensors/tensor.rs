//! Numbers in the bytes of a tensor.

use safetensors::Dtype;
use safetensors::tensor::TensorView;

use crate::http::wire::read::reader::Table;

/// Numbers of shape `[n]` or `[n, d]` in the bytes of a request.
pub struct Tensor<'a> {
    data: &'a [u8],
    pub length: usize,
    /// Numbers per row, or `None` for a list of numbers.
    pub width: Option<usize>,
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
    pub(super) fn of_view(view: &TensorView<'a>) -> Table<'a> {
        let width = match view.dtype() {
            Dtype::F64 => 8,
            Dtype::F32 => 4,
            other => return Table::Refused(format!("the tensor has dtype {other:?}, not F64 or F32")),
        };
        Self::table(view.data(), view.shape(), Layout { width, is_big_endian: false, is_transposed: false })
    }

    pub(super) fn table(data: &'a [u8], shape: &[usize], layout: Layout) -> Table<'a> {
        match *shape {
            [length] => Table::Tensor(Self { data, length, width: None, layout }),
            // Rows of length 0 take no bytes, so their number would be unbounded.
            [length, width] if width > 0 => Table::Tensor(Self { data, length, width: Some(width), layout }),
            _ => Table::Refused(format!("the tensor has shape {shape:?}, not [n] or [n, d]")),
        }
    }

    /// Returns a number by row and column. float32 is widened exactly. NaN stands for numbers beyond the data.
    #[inline]
    pub fn number(&self, row: usize, column: usize) -> f64 {
        let Layout { width, is_big_endian, is_transposed } = self.layout;
        let at =
            if is_transposed { column * self.length + row } else { row * self.width.unwrap_or(1) + column };
        let bytes = self.data.get(at * width..(at + 1) * width).unwrap_or_default();
        match (<[u8; 8]>::try_from(bytes), <[u8; 4]>::try_from(bytes), is_big_endian) {
            (Ok(bytes), _, false) => f64::from_le_bytes(bytes),
            (Ok(bytes), _, true) => f64::from_be_bytes(bytes),
            (_, Ok(bytes), false) => f32::from_le_bytes(bytes).into(),
            (_, Ok(bytes), true) => f32::from_be_bytes(bytes).into(),
            (Err(_), Err(_), _) => f64::NAN,
        }
    }
}
