//! LAS 1.0 to 1.4 of the ASPRS. Points have whole numbers, which the header scales and moves.

use super::FileCloud;
use super::columns::{Columns, Gaps, POSITIONS};
use super::records::{Field, Records, Scalar};

/// Bytes of the shortest header, of LAS 1.0 to 1.2.
const MIN_HEADER_BYTES: usize = 227;

/// Bits of the point format that say that points are compressed.
const COMPRESSED: u8 = 0xc0;

/// Bytes of a point without extra bytes, by format.
const POINT_BYTES: [usize; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/// First format of LAS 1.4, whose bits are elsewhere.
const FIRST_OF_1_4: u8 = 6;

/// Reads positions, colours, and what else was measured at the points.
pub fn read(bytes: &[u8]) -> Result<FileCloud, String> {
    let header = Header::parse(bytes)?;
    if header.is_compressed {
        return Err(
            "LAZ is not read: convert it with las2las -i scan.laz -o scan.las, or with PDAL".to_owned()
        );
    }
    let points = bytes.get(header.points_begin..).unwrap_or_default();
    let records = Records { bytes: points, count: header.n_points, width: header.width, name: "point" };
    let mut columns = records.columns(header.fields())?;
    header.place(&mut columns);
    columns.into_cloud(Gaps::Refused)
}

struct Header {
    points_begin: usize,
    format: u8,
    is_compressed: bool,
    width: usize,
    n_points: usize,
    scales: [f64; 3],
    offsets: [f64; 3],
}

impl Header {
    fn parse(bytes: &[u8]) -> Result<Self, String> {
        if bytes.len() < MIN_HEADER_BYTES {
            return Err("the file ends within its header".to_owned());
        }
        let number = |scalar: Scalar, offset| bytes.get(offset..).and_then(|bytes| scalar.read(bytes));
        let read = |scalar, offset| number(scalar, offset).unwrap_or_default();
        let whole = |scalar, offset| read(scalar, offset) as usize;
        let triple = |offset: usize| [0, 8, 16].map(|axis| read(Scalar::F64, offset + axis));
        let (major, minor, kind) = (bytes[24], bytes[25], bytes[104]);
        if major != 1 || minor > 4 {
            return Err(format!("LAS {major}.{minor} is not read, but 1.0 to 1.4 are"));
        }
        let format = kind & !COMPRESSED;
        let least = POINT_BYTES.get(usize::from(format));
        let least =
            *least.ok_or_else(|| format!("points of format {format} are not read, but 0 to 10 are"))?;
        let width = whole(Scalar::U16, 105);
        if width < least {
            return Err(format!("points of format {format} have {least} bytes, but the header says {width}"));
        }
        // The old number is 0 if there are more points than it can count.
        let (old, new) = (whole(Scalar::U32, 107), if minor == 4 { whole(Scalar::U64, 247) } else { 0 });
        let header = Self {
            points_begin: whole(Scalar::U32, 96),
            format,
            is_compressed: kind & COMPRESSED != 0,
            width,
            n_points: if new > 0 { new } else { old },
            scales: triple(131),
            offsets: triple(155),
        };
        let mut numbers = header.scales.iter().chain(&header.offsets);
        if numbers.any(|x| !x.is_finite()) || header.scales.contains(&0.0) {
            return Err("the header has scales or offsets that are no numbers".to_owned());
        }
        Ok(header)
    }

    /// Numbers of a point, as LAS places them by format.
    fn fields(&self) -> Vec<Field> {
        use Scalar::{F64, I8, I16, I32, U8, U16};
        let is_new = self.format >= FIRST_OF_1_4;
        let mut fields =
            vec![("x", I32, 0), ("y", I32, 4), ("z", I32, 8), ("intensity", U16, 12), ("returns", U8, 14)];
        if is_new {
            fields.extend([("classification", U8, 16), ("user_data", U8, 17), ("scan_angle", I16, 18)]);
            fields.extend([("point_source_id", U16, 20), ("gps_time", F64, 22)]);
        } else {
            fields.extend([("classification", U8, 15), ("scan_angle_rank", I8, 16), ("user_data", U8, 17)]);
            fields.push(("point_source_id", U16, 18));
        }
        if matches!(self.format, 1 | 3 | 4 | 5) {
            fields.push(("gps_time", F64, 20));
        }
        let colours = match self.format {
            2 => Some(20),
            3 | 5 => Some(28),
            7 | 8 | 10 => Some(30),
            _ => None,
        };
        if let Some(at) = colours {
            fields.extend([("red", U16, at), ("green", U16, at + 2), ("blue", U16, at + 4)]);
        }
        if matches!(self.format, 8 | 10) {
            fields.push(("nir", U16, 36));
        }
        let field =
            |(name, scalar, offset): (&str, Scalar, usize)| Field { name: name.to_owned(), scalar, offset };
        fields.into_iter().map(field).collect()
    }

    /// Scales and moves coordinates, and takes bits apart.
    fn place(&self, columns: &mut Columns) {
        let bits = if self.format >= FIRST_OF_1_4 { 4 } else { 3 };
        let mut returns = None;
        for (name, column) in columns.names.iter().zip(&mut columns.numbers) {
            if let Some(axis) = POSITIONS.iter().position(|axis| axis == name) {
                column.iter_mut().for_each(|x| *x = *x * self.scales[axis] + self.offsets[axis]);
            } else if name == "classification" && bits == 3 {
                // The three bits above the class are flags.
                column.iter_mut().for_each(|x| *x = f64::from(*x as u8 & 0x1f));
            } else if name == "returns" {
                returns = Some(column.clone());
            }
        }
        let at = columns.names.iter().position(|name| name == "returns");
        let (Some(at), Some(returns)) = (at, returns) else { return };
        let part = |shift: u8| {
            let mask = (1u8 << bits) - 1;
            returns.iter().map(|&x| f64::from(x as u8 >> shift & mask)).collect::<Vec<f64>>()
        };
        columns.names.splice(at..=at, ["return_number".to_owned(), "number_of_returns".to_owned()]);
        columns.numbers.splice(at..=at, [part(0), part(bits)]);
    }
}
