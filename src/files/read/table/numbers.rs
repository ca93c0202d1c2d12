//! Numbers of a table, which have either decimal points or decimal commas throughout.

/// How a number is written.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// `12`, `1e5`
    Whole,
    /// `1.5`, `.5`, `5.`
    WithPoint,
    /// `1,5`. Groups of three digits may be thousands: `1,234`.
    WithComma { may_be_thousands: bool },
    /// `nan`
    Missing,
}

impl Shape {
    /// The shape of a text. `None` if it is no number: `inf`, `0x10` and empty texts are none.
    pub fn of(cell: &str) -> Option<Self> {
        let unsigned = cell.strip_prefix(['+', '-']).unwrap_or(cell);
        if unsigned.eq_ignore_ascii_case("nan") {
            return Some(Self::Missing);
        }
        let (mantissa, exponent) = split_at(unsigned, &['e', 'E']);
        let exponent_is_good = exponent.is_none_or(|power| {
            let digits = power.strip_prefix(['+', '-']).unwrap_or(power);
            !digits.is_empty() && are_digits(digits)
        });
        let (whole, fraction) = split_at(mantissa, &['.', ',']);
        let mark = mantissa.as_bytes().get(whole.len());
        let fraction = fraction.unwrap_or_default();
        if !exponent_is_good
            || !are_digits(whole)
            || !are_digits(fraction)
            || whole.len() + fraction.len() == 0
        {
            return None;
        }
        match mark {
            None => Some(Self::Whole),
            Some(b'.') => Some(Self::WithPoint),
            Some(_) if whole.is_empty() || fraction.is_empty() => None,
            Some(_) => {
                let may_be_thousands =
                    exponent.is_none() && fraction.len() == 3 && whole.len() <= 3 && !whole.starts_with('0');
                Some(Self::WithComma { may_be_thousands })
            }
        }
    }
}

/// Parts a text at the first of some characters.
fn split_at<'a>(text: &'a str, marks: &[char]) -> (&'a str, Option<&'a str>) {
    text.split_once(marks).map_or((text, None), |(before, after)| (before, Some(after)))
}

fn are_digits(text: &str) -> bool {
    text.bytes().all(|byte| byte.is_ascii_digit())
}

pub fn is_decimal_comma(cell: &str) -> bool {
    matches!(Shape::of(cell), Some(Shape::WithComma { .. }))
}

/// Whether a text has digits, signs, quotes, separators and marks of numbers alone.
pub fn is_of_marks(cell: &str) -> bool {
    cell.chars().all(|c| c.is_ascii_digit() || matches!(c, '.' | ',' | '\'' | '"' | '+' | '-' | ' '))
}

/// The place of a cell.
#[derive(Clone, Copy)]
pub struct Place {
    pub line: usize,
    pub column: usize,
    /// Whether the number may be missing, NaN.
    pub may_miss: bool,
}

/// Decimal marks seen in a file.
#[derive(Default)]
pub struct Numbers {
    has_point: bool,
    /// The refusal of the first number with a comma, should commas be doubtful.
    doubt: Option<String>,
    /// Whether commas cannot stand for thousands.
    are_decimal: bool,
}

impl Numbers {
    /// Reads a cell.
    ///
    /// # Errors
    /// Says where the cell is and why it is no number.
    pub fn read(&mut self, cell: &str, Place { line, column, may_miss }: Place) -> Result<f64, String> {
        if cell.is_empty() {
            return Err(format!("line {line}: cell {} is empty", column + 1));
        }
        let refusal = |reason: &str| format!("line {line}: \"{}\" {reason}", shown(cell));
        let shape = Shape::of(cell).filter(|&shape| may_miss || shape != Shape::Missing);
        let remedy = if is_of_marks(cell) {
            ". Use one separator between columns, and none within numbers"
        } else {
            ""
        };
        let shape = shape.ok_or_else(|| refusal(&format!("is no number{remedy}")))?;
        let parsed = match shape {
            Shape::WithComma { .. } => cell.replace(',', ".").parse::<f64>(),
            _ => cell.parse::<f64>(),
        };
        let number = parsed.map_err(|_| refusal("is no number"))?;
        if number.is_infinite() {
            return Err(refusal("is too large"));
        }
        match shape {
            Shape::WithPoint if self.doubt.is_some() => {
                return Err(refusal("has a decimal point, numbers before it a decimal comma"));
            }
            Shape::WithComma { .. } if self.has_point => {
                return Err(refusal("has a decimal comma, numbers before it a decimal point"));
            }
            Shape::WithPoint => self.has_point = true,
            Shape::WithComma { may_be_thousands } => {
                let doubtful = || refusal("may be a decimal number or thousands. Write decimal points");
                self.doubt.get_or_insert_with(doubtful);
                self.are_decimal |= !may_be_thousands;
            }
            Shape::Whole | Shape::Missing => {}
        }
        Ok(number)
    }

    /// The refusal of a file whose commas may be decimal marks or marks of thousands.
    pub fn doubt(&self) -> Option<&String> {
        self.doubt.as_ref().filter(|_| !self.are_decimal)
    }

    pub fn has_point(&self) -> bool {
        self.has_point
    }
}

/// The beginning of a cell that is repeated in a refusal.
fn shown(cell: &str) -> String {
    cell.chars().take(40).collect()
}
