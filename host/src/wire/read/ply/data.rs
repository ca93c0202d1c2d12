//! The data of a PLY file, read record by record: binary numbers or lines of text.

use super::PlyError;
use super::header::{Element, Encoding, Header, Kind, Property, Scalar, shown};

/// Read position in the data. A copy reads the same records again.
#[derive(Clone, Copy)]
pub struct Cursor<'a> {
    rest: &'a [u8],
    encoding: Encoding,
    /// Lines of the file read so far, including the header.
    n_lines: usize,
}

/// Reason why a record cannot be read.
enum Broken {
    Ends,
    ListLength(f64),
    Text(String),
}

impl<'a> Cursor<'a> {
    pub fn new(data: &'a [u8], header: &Header<'_>) -> Self {
        Self { rest: data, encoding: header.encoding, n_lines: header.n_lines }
    }

    /// Lines of the file read so far, including the header. In binary, those of the header.
    pub fn n_lines(&self) -> usize {
        self.n_lines
    }

    /// Skips all records of an element.
    pub fn skip(&mut self, element: &Element<'_>) -> Result<(), PlyError> {
        // Without properties the records take no bytes, whatever their number.
        let (n_least, n_records) =
            (self.least_bytes(element), if element.properties.is_empty() { 0 } else { element.count });
        let has_lists = element.properties.iter().any(|property| matches!(property.kind, Kind::List { .. }));
        self.check_room(element)?;
        if self.encoding != Encoding::Text && !has_lists {
            // `check_room` has made sure that it fits.
            self.rest = self.rest.get(n_least * n_records..).unwrap_or_default();
            return Ok(());
        }
        for index in 0..n_records {
            let passed = match self.encoding {
                Encoding::Text => self.line().map(drop).ok_or(Broken::Ends),
                Encoding::LittleEndian | Encoding::BigEndian => self.numbers(&element.properties, |_, _| ()),
            };
            passed.map_err(|broken| self.failure(broken, element, index))?;
        }
        Ok(())
    }

    /// Refuses a count for which the body has too few bytes. No memory is allocated on the word of a header
    /// alone.
    pub fn check_room(&self, element: &Element<'_>) -> Result<(), PlyError> {
        let n_least = self.least_bytes(element);
        // The last line of a text needs no line end.
        let n_there = self.rest.len() + usize::from(self.encoding == Encoding::Text);
        match n_there.checked_div(n_least) {
            Some(room) if element.count > room => {
                let (element, announced) = (shown(element.name), element.count);
                Err(PlyError::Announced { element, announced, room })
            }
            _ => Ok(()),
        }
    }

    /// Fewest bytes that a record can take, with its lists empty. In text, each property takes a digit and a
    /// separator.
    fn least_bytes(&self, element: &Element<'_>) -> usize {
        let of_property = |property: &Property<'_>| match (self.encoding, property.kind) {
            (Encoding::Text, _) => 2,
            (_, Kind::Number(scalar) | Kind::List { length: scalar, .. }) => scalar.width(),
        };
        element.properties.iter().map(of_property).sum()
    }

    /// Reads a record and passes each number with the index of its property to `take`. Lists are skipped.
    pub fn record(
        &mut self,
        element: &Element<'_>,
        index: usize,
        take: impl FnMut(usize, f64),
        is_wanted: impl Fn(usize) -> bool,
    ) -> Result<(), PlyError> {
        let read = match self.encoding {
            Encoding::Text => self.words(&element.properties, take, is_wanted),
            Encoding::LittleEndian | Encoding::BigEndian => self.numbers(&element.properties, take),
        };
        read.map_err(|broken| self.failure(broken, element, index))
    }

    fn failure(&self, broken: Broken, element: &Element<'_>, index: usize) -> PlyError {
        let name = shown(element.name);
        match broken {
            Broken::Ends => PlyError::EndsEarly { element: name, index, announced: element.count },
            Broken::ListLength(length) => PlyError::ListLength { element: name, index, length },
            Broken::Text(reason) => PlyError::Text { line: self.n_lines, element: name, reason },
        }
    }

    /// Reads a binary record.
    fn numbers(
        &mut self,
        properties: &[Property<'_>],
        mut take: impl FnMut(usize, f64),
    ) -> Result<(), Broken> {
        for (place, property) in properties.iter().enumerate() {
            match property.kind {
                Kind::Number(scalar) => take(place, self.number(scalar)?),
                Kind::List { length, entry } => {
                    let length = self.number(length)?;
                    if length < 0.0 {
                        return Err(Broken::ListLength(length));
                    }
                    // `length` has 32 bits at most, so the conversion is exact and the product does not
                    // overflow.
                    let n_bytes = length as usize * entry.width();
                    self.bytes(n_bytes)?;
                }
            }
        }
        Ok(())
    }

    fn bytes(&mut self, n_bytes: usize) -> Result<&'a [u8], Broken> {
        let (bytes, rest) = self.rest.split_at_checked(n_bytes).ok_or(Broken::Ends)?;
        self.rest = rest;
        Ok(bytes)
    }

    fn number(&mut self, scalar: Scalar) -> Result<f64, Broken> {
        let is_big = self.encoding == Encoding::BigEndian;
        let bytes = self.bytes(scalar.width())?;
        scalar.read(bytes, is_big).ok_or(Broken::Ends)
    }

    /// Reads a record in text: a line with a word per number. A list is its length followed by its entries.
    fn words(
        &mut self,
        properties: &[Property<'_>],
        mut take: impl FnMut(usize, f64),
        is_wanted: impl Fn(usize) -> bool,
    ) -> Result<(), Broken> {
        let line = self.line().ok_or(Broken::Ends)?;
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let mut next = || words.next().ok_or_else(|| Broken::Text("there are too few numbers".to_owned()));
        for (place, property) in properties.iter().enumerate() {
            let word = next()?;
            match property.kind {
                Kind::Number(_) if is_wanted(place) => take(place, number_of(word)?),
                Kind::Number(_) => {}
                Kind::List { .. } => {
                    let length = str::from_utf8(word).ok().and_then(|word| word.parse::<u32>().ok());
                    let length = length.ok_or_else(|| no_number(word, "length of a list"))?;
                    for _ in 0..length {
                        next()?;
                    }
                }
            }
        }
        match words.next() {
            None => Ok(()),
            Some(_) => Err(Broken::Text("there are more numbers than the header announces".to_owned())),
        }
    }

    /// The next line that is not blank.
    fn line(&mut self) -> Option<&'a [u8]> {
        while !self.rest.is_empty() {
            let end = self.rest.iter().position(|&byte| byte == b'\n');
            let (line, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
            (self.rest, self.n_lines) = (rest.get(1..).unwrap_or_default(), self.n_lines + 1);
            if !line.trim_ascii().is_empty() {
                return Some(line);
            }
        }
        None
    }
}

/// Parses a decimal number as float64, whatever type the header declares.
fn number_of(word: &[u8]) -> Result<f64, Broken> {
    fast_float2::parse(word).map_err(|_| no_number(word, "number"))
}

fn no_number(word: &[u8], what: &str) -> Broken {
    Broken::Text(format!("{:?} is no {what}", shown(&String::from_utf8_lossy(&word[..word.len().min(160)]))))
}

impl Scalar {
    /// Decodes a binary number. All types convert to float64 exactly. `None` if the number of bytes does not
    /// fit the type.
    fn read(self, bytes: &[u8], is_big_endian: bool) -> Option<f64> {
        macro_rules! read {
            ($scalar:ty) => {{
                let bytes = bytes.try_into().ok()?;
                f64::from(if is_big_endian {
                    <$scalar>::from_be_bytes(bytes)
                } else {
                    <$scalar>::from_le_bytes(bytes)
                })
            }};
        }
        Some(match self {
            Self::Int8 => read!(i8),
            Self::Uint8 => read!(u8),
            Self::Int16 => read!(i16),
            Self::Uint16 => read!(u16),
            Self::Int32 => read!(i32),
            Self::Uint32 => read!(u32),
            Self::Float32 => read!(f32),
            Self::Float64 => read!(f64),
        })
    }
}
