//! Arrays of `NumPy`, whose columns are all coordinates.

use gramian_host::wire::read::tensors::npy::Npy;

use super::FileCloud;
use super::columns::{Columns, POSITIONS, Places};
use super::records::ends_early;

const MAX_HEADER_BYTES: usize = 64 << 10;

/// Reads an array `[n, d]` of either order, width and byte order.
pub fn read(bytes: &[u8]) -> Result<FileCloud, String> {
    let array = Npy::parse(bytes, MAX_HEADER_BYTES).ok_or("the header of the npy file is damaged")?;
    let decode = decoder_of(array.descr)?;
    let [n, d] = array.shape[..] else {
        let shape: Vec<String> = array.shape.iter().map(ToString::to_string).collect();
        return Err(format!("the array has the shape ({}), not [n, d]", shape.join(", ")));
    };
    let there = array.data.chunks_exact(decode.width).len();
    if n == 0 || d == 0 {
        return Err("the file has no points".to_owned());
    }
    if n.checked_mul(d).is_none_or(|n_numbers| n_numbers > there) {
        return Err(ends_early("point", if array.fortran_order { 0 } else { there / d }, n));
    }
    let numbers: Vec<f64> = array.data.chunks_exact(decode.width).take(n * d).map(decode.read).collect();
    let points = if array.fortran_order { transposed(&numbers, n) } else { numbers };
    checked(points, d)
}

/// How a number is read.
struct Decoder {
    width: usize,
    read: fn(&[u8]) -> f64,
}

fn decoder_of(descr: &str) -> Result<Decoder, String> {
    macro_rules! decoder {
        ($scalar:ty, $from:ident) => {
            Decoder {
                width: size_of::<$scalar>(),
                read: |bytes| f64::from(<$scalar>::$from(bytes.try_into().unwrap_or_default())),
            }
        };
    }
    Ok(match descr {
        "<f8" => decoder!(f64, from_le_bytes),
        ">f8" => decoder!(f64, from_be_bytes),
        "<f4" => decoder!(f32, from_le_bytes),
        ">f4" => decoder!(f32, from_be_bytes),
        other => return Err(format!("the array has dtype '{other}', not '<f8' or '<f4'")),
    })
}

/// Rows of numbers that stand column by column.
fn transposed(numbers: &[f64], n: usize) -> Vec<f64> {
    (0..n).flat_map(|row| numbers.iter().skip(row).step_by(n).copied()).collect()
}

/// A cloud of rows with any number of coordinates.
fn checked(points: Vec<f64>, dimension: usize) -> Result<FileCloud, String> {
    let name = |axis: usize| match POSITIONS.get(axis) {
        Some(&name) if dimension <= POSITIONS.len() => name.to_owned(),
        _ => format!("coordinate {}", axis + 1),
    };
    let names = (0..dimension).map(name).collect();
    let numbers = (0..dimension).map(|axis| points.iter().skip(axis).step_by(dimension).copied().collect());
    let columns = Columns { names, numbers: numbers.collect(), places: Places::Records("point") };
    columns.check_finite(&(0..dimension).collect::<Vec<_>>())?;
    Ok(FileCloud { points, dimension, ..FileCloud::default() })
}
