//! Numbers in the bytes of a tensor.

use safetensors::Dtype;
use safetensors::tensor::TensorView;

use crate::problem::Problem;
use crate::wire::read::reader::{Given, Table};

/// Numbers of shape `[n]` or `[n, d]` in the bytes of a request.
pub(super) struct Tensor<'a> {
    data: &'a [u8],
    length: usize,
    /// Numbers per row, or `None` for a list of numbers.
    width: Option<usize>,
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
    pub(super) fn of_view(view: &TensorView<'a>) -> Given<'a> {
        let width = match view.dtype() {
            Dtype::F64 => 8,
            Dtype::F32 => 4,
            other => return Err(format!("the tensor has dtype {other:?}, not F64 or F32")),
        };
        Self::of(view.data(), view.shape(), Layout { width, is_big_endian: false, is_transposed: false })
    }

    pub(super) fn of(data: &'a [u8], shape: &[usize], layout: Layout) -> Given<'a> {
        match *shape {
            [length] => Ok(Box::new(Self { data, length, width: None, layout })),
            // Rows of length 0 take no bytes, so their number would be unbounded.
            [length, width] if width > 0 => Ok(Box::new(Self { data, length, width: Some(width), layout })),
            _ => Err(format!("the tensor has shape {shape:?}, not [n] or [n, d]")),
        }
    }

    /// Place in the data of a number that is counted row by row.
    fn place(&self, index: usize) -> usize {
        match self.width {
            Some(width) if self.layout.is_transposed => index % width * self.length + index / width,
            _ => index,
        }
    }

    /// Returns the number at a place. float32 is widened exactly. NaN stands for numbers beyond the data.
    fn number(&self, at: usize) -> f64 {
        let Layout { width, is_big_endian, .. } = self.layout;
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

impl Table for Tensor<'_> {
    fn length(&self) -> usize {
        self.length
    }

    fn width(&self) -> Option<usize> {
        self.width
    }

    fn read(&mut self, index: usize, numbers: &mut [f64]) -> Result<usize, Box<Problem>> {
        let indices = index..self.length * self.width.unwrap_or(1);
        let n_read = numbers.len().min(indices.len());
        for (x, index) in numbers.iter_mut().zip(indices) {
            *x = self.number(self.place(index));
        }
        Ok(n_read)
    }
}
