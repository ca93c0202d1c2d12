//! PCD, the format of the Point Cloud Library, in its three encodings.

use std::borrow::Cow;

use super::FileCloud;
use super::columns::{Columns, Gaps};
use super::lzf;
use super::records::{Field, Lines, Records, Scalar};

/// Longest header in bytes. Headers take some hundreds.
const MAX_HEADER_BYTES: usize = 64 << 10;

/// Most numbers of a point: the largest descriptors have some hundreds.
const MAX_FIELDS: usize = 4096;

/// Name of fields that fill a point up to a round size.
const PADDING: &str = "_";

/// Fields whose four bytes are blue, green, red and maybe opacity.
const PACKED_COLOURS: [&str; 2] = ["rgb", "rgba"];

/// Reads the points. Those without a position are left out.
pub fn read(bytes: &[u8]) -> Result<FileCloud, String> {
    let header = Header::parse(bytes)?;
    let body = bytes.get(header.n_bytes..).unwrap_or_default();
    let columns = match header.encoding {
        "ascii" => {
            let names = header.numbers().map(|(name, ..)| name).collect();
            Lines { bytes: body, n_before: header.n_lines }.columns(names, header.n_points)?
        }
        "binary" => header.rows(body)?,
        "binary_compressed" => header.rows(&decompressed(body, &header)?)?,
        other => return Err(format!("DATA is {other:?}, not ascii, binary or binary_compressed")),
    };
    with_colours(columns, &header).into_cloud(Gaps::LeftOut)
}

/// The header: fields, number of points and encoding.
struct Header<'a> {
    fields: Vec<PcdField<'a>>,
    n_points: usize,
    encoding: &'a str,
    n_bytes: usize,
    n_lines: usize,
}

struct PcdField<'a> {
    name: &'a str,
    scalar: Scalar,
    /// Numbers in each point.
    count: usize,
}

impl PcdField<'_> {
    fn width(&self) -> usize {
        self.scalar.width() * self.count
    }
}

impl<'a> Header<'a> {
    fn parse(bytes: &'a [u8]) -> Result<Self, String> {
        let (mut entries, mut n_bytes, mut n_lines) = (Vec::new(), 0, 0);
        let head = bytes.get(..MAX_HEADER_BYTES).unwrap_or(bytes);
        for line in head.split_inclusive(|&byte| byte == b'\n') {
            (n_bytes, n_lines) = (n_bytes + line.len(), n_lines + 1);
            // Comments may be in any encoding.
            let mut words = std::str::from_utf8(line).unwrap_or_default().split_ascii_whitespace();
            let Some(keyword) = words.next().filter(|word| !word.starts_with('#')) else { continue };
            entries.push((keyword, words.collect::<Vec<_>>()));
            if keyword == "DATA" {
                break;
            }
        }
        let entry = |name: &str| entries.iter().find(|(keyword, _)| *keyword == name).map(|(_, words)| words);
        let encoding = entry("DATA").and_then(|words| words.first()).copied();
        let encoding = encoding.ok_or("the header does not end: it has no line DATA")?;
        let names = entry("FIELDS").or_else(|| entry("COLUMNS")).ok_or("the header has no line FIELDS")?;
        let (sizes, types) = (entry("SIZE"), entry("TYPE"));
        let word = |words: Option<&Vec<&'a str>>, at: usize| words.and_then(|words| words.get(at)).copied();
        let field = |(at, &name): (usize, &&'a str)| {
            let (size, letter) = (word(sizes, at).unwrap_or_default(), word(types, at).unwrap_or_default());
            let scalar = scalar_of(letter, size);
            let scalar = scalar.ok_or_else(|| format!("the type of {name}, {letter}{size}, is unknown"))?;
            let count = word(entry("COUNT"), at).unwrap_or("1").parse().ok();
            let count = count.filter(|count| (1..=MAX_FIELDS).contains(count));
            let count = count.ok_or_else(|| format!("COUNT of {name} is not a count"))?;
            Ok(PcdField { name, scalar, count })
        };
        let fields = names.iter().enumerate().map(field).collect::<Result<Vec<_>, String>>()?;
        let number = |name: &str| word(entry(name), 0).and_then(|word| word.parse::<usize>().ok());
        let grid = || number("WIDTH")?.checked_mul(number("HEIGHT")?);
        let n_points = number("POINTS").or_else(grid).ok_or("the header has no number of points")?;
        let header = Self { fields, n_points, encoding, n_bytes, n_lines };
        header.check_names()?;
        Ok(header)
    }

    fn check_names(&self) -> Result<(), String> {
        let names: Vec<&str> = self.fields.iter().map(|field| field.name).collect();
        let twice =
            names.iter().enumerate().find(|(at, name)| **name != PADDING && names[..*at].contains(name));
        if let Some((_, name)) = twice {
            return Err(format!("the header names {name} twice"));
        }
        match self.fields.iter().map(|field| field.count).sum::<usize>() {
            0..=MAX_FIELDS => Ok(()),
            _ => Err(format!("a point has more than {MAX_FIELDS} numbers")),
        }
    }

    /// Name, type and offset of every number of a point. Numbers of one field are counted from 0.
    fn numbers(&self) -> impl Iterator<Item = (String, Scalar, usize)> {
        let mut offset = 0;
        self.fields.iter().flat_map(move |field| {
            let begins = offset;
            offset += field.width();
            (0..field.count).map(move |at| {
                let name =
                    if field.count == 1 { field.name.to_owned() } else { format!("{}_{at}", field.name) };
                (name, field.scalar, begins + at * field.scalar.width())
            })
        })
    }

    fn width(&self) -> usize {
        self.fields.iter().map(PcdField::width).sum()
    }

    /// Reads points that stand one after another.
    fn rows(&self, bytes: &[u8]) -> Result<Columns, String> {
        let records = Records { bytes, count: self.n_points, width: self.width(), name: "point" };
        records.columns(self.numbers().map(|(name, scalar, offset)| Field { name, scalar, offset }).collect())
    }
}

fn scalar_of(letter: &str, size: &str) -> Option<Scalar> {
    Some(match (letter, size) {
        ("I", "1") => Scalar::I8,
        ("I", "2") => Scalar::I16,
        ("I", "4") => Scalar::I32,
        ("I", "8") => Scalar::I64,
        ("U", "1") => Scalar::U8,
        ("U", "2") => Scalar::U16,
        ("U", "4") => Scalar::U32,
        ("U", "8") => Scalar::U64,
        ("F", "4") => Scalar::F32,
        ("F", "8") => Scalar::F64,
        _ => return None,
    })
}

/// The points of a compressed body, one after another. The body has all numbers of the first field, then all
/// of the second, and so on, after its sizes with and without compression.
fn decompressed<'a>(body: &[u8], header: &Header<'_>) -> Result<Cow<'a, [u8]>, String> {
    let size = |at: usize| body.get(at..)?.first_chunk().map(|&bytes| u32::from_le_bytes(bytes) as usize);
    let (Some(compressed), Some(whole)) = (size(0), size(4)) else {
        return Err("the file ends before its compressed points".to_owned());
    };
    let Some(packed) = body[8..].get(..compressed) else {
        let n_there = body.len() - 8;
        return Err(format!("the file ends at byte {n_there} of {compressed} of its compressed points"));
    };
    if header.n_points.checked_mul(header.width()) != Some(whole) {
        let (n_points, width) = (header.n_points, header.width());
        return Err(format!("{whole} bytes are not those of {n_points} points with {width} bytes each"));
    }
    let fields = lzf::decompressed(packed, whole).ok_or("the compressed points are damaged")?;
    let (mut rows, width) = (vec![0; whole], header.width());
    let (mut begins, mut offset) = (0, 0);
    for field in &header.fields {
        let column = fields[begins..].chunks_exact(field.width()).take(header.n_points);
        for (row, number) in rows.chunks_exact_mut(width).zip(column) {
            row[offset..offset + field.width()].copy_from_slice(number);
        }
        begins += field.width() * header.n_points;
        offset += field.width();
    }
    Ok(rows.into())
}

/// Replaces packed colours by three columns, and drops what fills points up.
fn with_colours(columns: Columns, header: &Header<'_>) -> Columns {
    let Columns { names, numbers, places } = columns;
    let mut unpacked = Columns { names: Vec::new(), numbers: Vec::new(), places };
    let mut add = |name: String, column| {
        unpacked.names.push(name);
        unpacked.numbers.push(column);
    };
    let scalars = header.numbers().map(|(_, scalar, _)| scalar);
    for ((name, column), scalar) in names.into_iter().zip(numbers).zip(scalars) {
        if PACKED_COLOURS.contains(&name.as_str()) && scalar.width() == 4 {
            for (colour, shift) in [("red", 16), ("green", 8), ("blue", 0)] {
                let channel = |&x: &f64| f64::from(bits_of(x, scalar) >> shift & 0xff);
                add(colour.to_owned(), column.iter().map(channel).collect());
            }
        } else if name != PADDING && !name.starts_with("__") {
            add(name, column);
        }
    }
    unpacked
}

/// The bits of a colour, which is often written as the float that has the same bits.
fn bits_of(x: f64, scalar: Scalar) -> u32 {
    match scalar {
        Scalar::F32 => (x as f32).to_bits(),
        _ => x as i64 as u32,
    }
}
