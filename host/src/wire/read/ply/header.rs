//! The header of a PLY file: which elements there are, and how their numbers are encoded.

use super::{MAX_HEADER_BYTES, PlyError};

/// A parsed header, with the elements in the order of the file.
pub struct Header<'a> {
    pub encoding: Encoding,
    pub elements: Vec<Element<'a>>,
    /// Lines of the header, including the last one.
    pub n_lines: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// A group of `count` records with the same properties.
#[derive(Clone)]
pub struct Element<'a> {
    pub name: &'a str,
    pub count: usize,
    pub properties: Vec<Property<'a>>,
}

#[derive(Clone)]
pub struct Property<'a> {
    pub name: &'a str,
    pub kind: Kind,
}

#[derive(Debug, Clone, Copy)]
pub enum Kind {
    Number(Scalar),
    /// A list: its length, then its entries.
    List {
        length: Scalar,
        entry: Scalar,
    },
}

/// Scalar types of PLY. Each has two names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scalar {
    Int8,
    Uint8,
    Int16,
    Uint16,
    Int32,
    Uint32,
    Float32,
    Float64,
}

impl<'a> Header<'a> {
    /// Reads the header. Also returns the data that follows it.
    pub fn parse(bytes: &'a [u8]) -> Result<(Self, &'a [u8]), PlyError> {
        let mut lines = Lines { rest: bytes, room: MAX_HEADER_BYTES, n_lines: 0 };
        if lines.next().is_none_or(|line| line != b"ply") {
            return Err(PlyError::NoMagic);
        }
        let (mut encoding, mut elements) = (None, Vec::new());
        loop {
            let line = lines.next().ok_or(PlyError::EndlessHeader)?;
            // Comments are skipped before UTF-8 is checked: they may be in any encoding.
            if [&b"comment"[..], b"obj_info"].iter().any(|word| line.starts_with(word)) {
                continue;
            }
            let is_last = read_line(line, &mut encoding, &mut elements)
                .map_err(|reason| PlyError::Header { line: lines.n_lines, reason })?;
            if is_last {
                break;
            }
        }
        let Some(encoding) = encoding else {
            return Err(PlyError::Header { line: 2, reason: "there is no line \"format\"".to_owned() });
        };
        Ok((Self { encoding, elements, n_lines: lines.n_lines }, lines.rest))
    }
}

/// The lines of a header without their ends, LF or CR LF.
struct Lines<'a> {
    rest: &'a [u8],
    /// Bytes that the header may still take.
    room: usize,
    n_lines: usize,
}

impl<'a> Lines<'a> {
    fn next(&mut self) -> Option<&'a [u8]> {
        let end = self.rest.iter().take(self.room).position(|&byte| byte == b'\n')?;
        let (line, rest) = (&self.rest[..end], &self.rest[end + 1..]);
        (self.rest, self.room, self.n_lines) = (rest, self.room - end - 1, self.n_lines + 1);
        Some(line.strip_suffix(b"\r").unwrap_or(line))
    }
}

/// Reads a line of the header. Returns whether it is the last one.
fn read_line<'a>(
    line: &'a [u8],
    encoding: &mut Option<Encoding>,
    elements: &mut Vec<Element<'a>>,
) -> Result<bool, String> {
    let text = str::from_utf8(line).map_err(|_| "it is no text".to_owned())?;
    // The longest known line, a list, has five words. A sixth stands for the rest of a longer line.
    let words: Vec<&str> = text.split_ascii_whitespace().take(6).collect();
    match words[..] {
        ["end_header"] => return Ok(true),
        ["format", name, version] if encoding.is_none() => *encoding = Some(format_of(name, version)?),
        ["format", ..] if encoding.is_some() => return Err("the format is given twice".to_owned()),
        ["element", name, count] => elements.push(element_of(name, count, elements)?),
        ["property", ..] => {
            let element = elements.last_mut().ok_or("it belongs to no element")?;
            let property = property_of(&words)?;
            if element.properties.iter().any(|known| known.name == property.name) {
                return Err(format!("a second property {:?}", shown(property.name)));
            }
            element.properties.push(property);
        }
        _ => return Err(format!("{:?} is no line of a header", shown(text))),
    }
    Ok(false)
}

fn format_of(name: &str, version: &str) -> Result<Encoding, String> {
    match (name, version) {
        ("ascii", "1.0") => Ok(Encoding::Text),
        ("binary_little_endian", "1.0") => Ok(Encoding::LittleEndian),
        ("binary_big_endian", "1.0") => Ok(Encoding::BigEndian),
        _ => Err(format!(
            "format {:?} is none of ascii, binary_little_endian and binary_big_endian 1.0",
            shown(&format!("{name} {version}"))
        )),
    }
}

fn element_of<'a>(name: &'a str, count: &str, known: &[Element<'a>]) -> Result<Element<'a>, String> {
    if known.iter().any(|element| element.name == name) {
        return Err(format!("a second element {:?}", shown(name)));
    }
    let is_plain = count.bytes().all(|digit| digit.is_ascii_digit());
    let count = count.parse().ok().filter(|_| is_plain);
    let count = count.ok_or_else(|| format!("element {:?} has an impossible count", shown(name)))?;
    Ok(Element { name, count, properties: Vec::new() })
}

fn property_of<'a>(words: &[&'a str]) -> Result<Property<'a>, String> {
    match *words {
        ["property", "list", length, entry, name] => {
            let (length, entry) = (scalar_of(length)?, scalar_of(entry)?);
            if matches!(length, Scalar::Float32 | Scalar::Float64) {
                return Err("the length of a list is a whole number".to_owned());
            }
            Ok(Property { name, kind: Kind::List { length, entry } })
        }
        ["property", kind, name] => Ok(Property { name, kind: Kind::Number(scalar_of(kind)?) }),
        _ => Err("a property has a type and a name".to_owned()),
    }
}

fn scalar_of(name: &str) -> Result<Scalar, String> {
    Ok(match name {
        "char" | "int8" => Scalar::Int8,
        "uchar" | "uint8" => Scalar::Uint8,
        "short" | "int16" => Scalar::Int16,
        "ushort" | "uint16" => Scalar::Uint16,
        "int" | "int32" => Scalar::Int32,
        "uint" | "uint32" => Scalar::Uint32,
        "float" | "float32" => Scalar::Float32,
        "double" | "float64" => Scalar::Float64,
        _ => return Err(format!("{:?} is no type of PLY", shown(name))),
    })
}

/// Shortens a text that is repeated to the client.
pub fn shown(text: &str) -> String {
    text.chars().take(40).collect()
}

impl Element<'_> {
    /// The index of a number among the properties.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.properties
            .iter()
            .position(|property| property.name == name && matches!(property.kind, Kind::Number(_)))
    }

    /// The indices of three numbers, if all are present.
    pub fn columns(&self, names: [&str; 3]) -> Option<[usize; 3]> {
        let [x, y, z] = names.map(|name| self.column(name));
        Some([x?, y?, z?])
    }
}

impl Scalar {
    /// Bytes of a number in binary.
    pub fn width(self) -> usize {
        match self {
            Self::Int8 | Self::Uint8 => 1,
            Self::Int16 | Self::Uint16 => 2,
            Self::Int32 | Self::Uint32 | Self::Float32 => 4,
            Self::Float64 => 8,
        }
    }
}
