//! Rows of binary numbers, and rows of numbers in text.

use super::columns::{Columns, Places};
use super::shown;

/// Types of little-endian numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scalar {
    I8,
    I16,
    I32,
    I64,
    U8,
    U16,
    U32,
    U64,
    F32,
    F64,
}

impl Scalar {
    pub fn width(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Decodes the number at the beginning of some bytes. `None` if they are too few.
    ///
    /// Whole numbers of 64 bits are rounded to float64.
    pub fn read(self, bytes: &[u8]) -> Option<f64> {
        macro_rules! read {
            ($scalar:ty) => {
                <$scalar>::from_le_bytes(*bytes.first_chunk()?) as f64
            };
        }
        Some(match self {
            Self::I8 => read!(i8),
            Self::I16 => read!(i16),
            Self::I32 => read!(i32),
            Self::I64 => read!(i64),
            Self::U8 => read!(u8),
            Self::U16 => read!(u16),
            Self::U32 => read!(u32),
            Self::U64 => read!(u64),
            Self::F32 => read!(f32),
            Self::F64 => read!(f64),
        })
    }
}

/// The number of a field, and where it begins in a record.
pub struct Field {
    pub name: String,
    pub scalar: Scalar,
    pub offset: usize,
}

/// Records of equal size, one after another.
pub struct Records<'a> {
    pub bytes: &'a [u8],
    pub count: usize,
    pub width: usize,
    /// Name of a record in refusals: "point".
    pub name: &'static str,
}

impl Records<'_> {
    /// Reads a column for each field.
    ///
    /// # Errors
    /// Says in which record the file ends, before anything is allocated.
    pub fn columns(&self, fields: Vec<Field>) -> Result<Columns, String> {
        let n_there = self.bytes.len().checked_div(self.width).unwrap_or_default();
        if n_there < self.count {
            return Err(ends_early(self.name, n_there, self.count));
        }
        let column = |field: &Field| {
            let rows = self.bytes.chunks_exact(self.width.max(1)).take(self.count);
            let numbers = rows.map(|row| row.get(field.offset..).and_then(|bytes| field.scalar.read(bytes)));
            numbers.collect::<Option<Vec<f64>>>()
        };
        let numbers = fields.iter().map(column).collect::<Option<Vec<_>>>();
        let numbers = numbers.ok_or_else(|| format!("a field lies outside the {}", self.name))?;
        let names = fields.into_iter().map(|field| field.name).collect();
        Ok(Columns { names, numbers, places: Places::Records(self.name) })
    }
}

/// The refusal of a file that has `n_there` whole records of those announced.
pub fn ends_early(record: &str, n_there: usize, announced: usize) -> String {
    format!("the file ends before the end of {record} {} of {announced}", n_there + 1)
}

/// Lines of text that begin in the middle of a file.
pub struct Lines<'a> {
    pub bytes: &'a [u8],
    /// Lines of the file before these.
    pub n_before: usize,
}

impl Lines<'_> {
    /// Reads `count` rows, one a line, with a number for each name. Blank lines are skipped, and so is what
    /// follows the rows.
    ///
    /// # Errors
    /// Says which line has too few or too many numbers, or a word that is none.
    pub fn columns(&self, names: Vec<String>, count: usize) -> Result<Columns, String> {
        let (mut numbers, mut lines) = (vec![Vec::new(); names.len()], Vec::new());
        for (at, line) in self.bytes.split(|&byte| byte == b'\n').enumerate() {
            if lines.len() == count {
                break;
            }
            let (line, number) = (String::from_utf8_lossy(line), self.n_before + at + 1);
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            if words.is_empty() {
                continue;
            }
            if words.len() != names.len() {
                let (found, announced) = (words.len(), names.len());
                return Err(format!(
                    "line {number}: {found} numbers, but the header announces {announced} columns"
                ));
            }
            for (column, word) in numbers.iter_mut().zip(words) {
                column.push(number_of(word).map_err(|reason| format!("line {number}: {reason}"))?);
            }
            lines.push(number);
        }
        if lines.len() < count {
            return Err(ends_early("point", lines.len(), count));
        }
        Ok(Columns { names, numbers, places: Places::Lines(lines) })
    }
}

/// A decimal number or, as scanners write what they have not measured, NaN or an infinity.
pub fn number_of(word: &str) -> Result<f64, String> {
    word.parse().map_err(|_| format!("\"{}\" is no number", shown(word)))
}
