//! A cursor over the text of a JSON document.
//!
//! It reads what `serde_json` reads, to the last bit, and refuses what that refuses: a property test checks
//! both. It is 1.5 times as fast for lists of numbers (`benches/bodies.rs`), whose digits are parsed with the
//! algorithm of Lemire, "Number parsing at a gigabyte per second" (2021), which rounds correctly. What is
//! rare is left to `serde_json`: escapes in strings, values that are skipped, and the wording of errors.

use std::borrow::Cow;

use memchr::{memchr, memchr_iter};
use serde::de::{Error as _, Expected, IgnoredAny, Unexpected};
use serde_json::Error;

/// The unread rest of a text.
pub(super) struct Text<'a> {
    whole: &'a [u8],
    rest: &'a [u8],
    /// Why the text is not JSON, found before the unread rest.
    flaw: Option<String>,
}

/// A value, or the beginning of a list or an object.
pub(super) enum Token<'a> {
    Object,
    List,
    String(Cow<'a, str>),
    Bool(bool),
    Null,
    Unsigned(u64),
    Signed(i64),
    Float(f64),
}

impl Token<'_> {
    /// The error for a value of another type than the expected one.
    #[cold]
    pub(super) fn refused(&self, expected: &dyn Expected) -> Error {
        let unexpected = match self {
            Self::Object => Unexpected::Map,
            Self::List => Unexpected::Seq,
            Self::String(string) => Unexpected::Str(string),
            Self::Bool(x) => Unexpected::Bool(*x),
            Self::Null => Unexpected::Unit,
            Self::Unsigned(x) => Unexpected::Unsigned(*x),
            Self::Signed(x) => Unexpected::Signed(*x),
            Self::Float(x) => Unexpected::Float(*x),
        };
        Error::invalid_type(unexpected, expected)
    }
}

impl<'a> Text<'a> {
    pub(super) fn new(text: &'a [u8]) -> Self {
        Self { whole: text, rest: text, flaw: None }
    }

    /// The whole text, from its beginning.
    pub(super) fn whole(&self) -> &'a [u8] {
        self.whole
    }

    /// Why the text is not JSON and where, if this was found.
    pub(super) fn flaw(&self) -> Option<String> {
        let read = &self.whole[..self.whole.len() - self.rest.len()];
        let line = 1 + memchr_iter(b'\n', read).count();
        let column = read.iter().rev().take_while(|&&byte| byte != b'\n').count();
        self.flaw.as_ref().map(|flaw| format!("{flaw} at line {line} column {column}"))
    }

    #[cold]
    pub(super) fn fail(&mut self, flaw: &str) -> Error {
        self.flaw = Some(flaw.to_owned());
        Error::custom(flaw)
    }

    fn skip_whitespace(&mut self) {
        while let [b' ' | b'\n' | b'\r' | b'\t', rest @ ..] = self.rest {
            self.rest = rest;
        }
    }

    /// The next byte after whitespace.
    pub(super) fn peek(&mut self) -> Option<u8> {
        self.skip_whitespace();
        self.rest.first().copied()
    }

    /// Reads a literal such as `true`. The caller's next step checks that the literal ends there.
    fn take(&mut self, literal: &str) -> Result<(), Error> {
        self.skip_whitespace();
        match self.rest.strip_prefix(literal.as_bytes()) {
            Some(rest) => self.rest = rest,
            None => return Err(self.fail(&format!("expected {literal}"))),
        }
        Ok(())
    }

    /// Checks that nothing follows.
    pub(super) fn end(&mut self) -> Result<(), Error> {
        if self.peek().is_none() { Ok(()) } else { Err(self.fail("trailing characters")) }
    }

    /// Whether another entry of a list or an object follows. Consumes the comma before it, or the closing
    /// bracket.
    #[inline(always)]
    pub(super) fn goes_on(&mut self, closing: u8, is_first: &mut bool) -> Result<bool, Error> {
        let next = self.peek();
        if next == Some(closing) {
            self.rest = &self.rest[1..];
            return Ok(false);
        }
        if !std::mem::take(is_first) {
            if next != Some(b',') {
                return Err(self.fail("expected a comma or the closing bracket"));
            }
            self.rest = &self.rest[1..];
        }
        Ok(true)
    }

    /// Reads the bracket that opens a list, if there is one.
    #[inline(always)]
    pub(super) fn opens_list(&mut self) -> bool {
        let opens = self.peek() == Some(b'[');
        if opens {
            self.rest = &self.rest[1..];
        }
        opens
    }

    /// Reads a value, or the bracket that opens a list or an object.
    pub(super) fn token(&mut self) -> Result<Token<'a>, Error> {
        Ok(match self.peek() {
            Some(b'{') => self.take("{").map(|()| Token::Object)?,
            Some(b'[') => self.take("[").map(|()| Token::List)?,
            Some(b'"') => Token::String(self.string()?),
            Some(b't') => self.take("true").map(|()| Token::Bool(true))?,
            Some(b'f') => self.take("false").map(|()| Token::Bool(false))?,
            Some(b'n') => self.take("null").map(|()| Token::Null)?,
            _ => match self.integer() {
                Some(integer) => integer,
                None => Token::Float(self.number()?),
            },
        })
    }

    /// Reads the name of a member, and the colon after it.
    pub(super) fn name(&mut self) -> Result<Cow<'a, str>, Error> {
        let name = self.string()?;
        self.take(":").map(|()| name)
    }

    fn string(&mut self) -> Result<Cow<'a, str>, Error> {
        self.take("\"")?;
        let (mut is_plain, mut is_escaped) = (true, false);
        let end = self.rest.iter().position(|&byte| {
            let ends = byte == b'"' && !is_escaped;
            is_escaped = byte == b'\\' && !is_escaped;
            is_plain &= byte != b'\\' && byte >= b' ';
            ends
        });
        let Some(end) = end else { return Err(self.fail("EOF while parsing a string")) };
        let (string, rest) = self.rest.split_at(end);
        let quoted = &self.whole[self.whole.len() - self.rest.len() - 1..][..end + 2];
        self.rest = &rest[1..];
        match str::from_utf8(string) {
            Ok(string) if is_plain => Ok(Cow::Borrowed(string)),
            _ => serde_json::from_slice(quoted).map(Cow::Owned).map_err(|error| {
                let error = error.to_string();
                // The position is that within the string.
                self.fail(error.split_once(" at line ").map_or(&error, |(flaw, _)| flaw))
            }),
        }
    }

    /// Whether a number follows, as far as its first byte tells.
    #[inline(always)]
    pub(super) fn is_number(&mut self) -> bool {
        self.peek().is_some_and(|byte| byte == b'-' || byte.is_ascii_digit())
    }

    /// Reads a number by the grammar of JSON, which is narrower than that of the library.
    ///
    /// There is no leading plus or zero, digits stand on both sides of the point, and `inf` and `nan` are
    /// refused.
    #[inline(always)]
    pub(super) fn number(&mut self) -> Result<f64, Error> {
        let text = self.rest;
        let Ok((x, length)) = fast_float2::parse_partial::<f64, _>(text) else {
            return Err(self.fail("expected value"));
        };
        let digits = text.strip_prefix(b"-").unwrap_or(text);
        let is_integer_part = match digits {
            [b'0', next, ..] => !next.is_ascii_digit(),
            [first, ..] => first.is_ascii_digit(),
            [] => false,
        };
        let fraction =
            digits[..length - (text.len() - digits.len())].iter().position(|&byte| !byte.is_ascii_digit());
        let is_fraction = match fraction {
            Some(at) if digits[at] == b'.' => digits.get(at + 1).is_some_and(u8::is_ascii_digit),
            Some(_) | None => true,
        };
        if !(is_integer_part && is_fraction) {
            return Err(self.fail("invalid number"));
        }
        self.rest = &text[length..];
        if x.is_finite() { Ok(x) } else { Err(self.fail("number out of range")) }
    }

    /// Reads a number without fraction and exponent, if there is one here that 64 bits hold.
    fn integer(&mut self) -> Option<Token<'a>> {
        let text = self.rest;
        let digits = text.strip_prefix(b"-").unwrap_or(text);
        let n_digits = digits.iter().take_while(|byte| byte.is_ascii_digit()).count();
        let has_leading_zero = digits.first() == Some(&b'0') && n_digits > 1;
        if has_leading_zero || matches!(digits.get(n_digits), Some(b'.' | b'e' | b'E')) {
            return None;
        }
        let (number, rest) = text.split_at(text.len() - digits.len() + n_digits);
        let number = str::from_utf8(number).ok()?;
        let integer = match number.strip_prefix('-') {
            // Integers have no zero with a sign.
            Some("0") => None,
            Some(_) => number.parse().ok().map(Token::Signed),
            None => number.parse().ok().map(Token::Unsigned),
        };
        self.rest = if integer.is_some() { rest } else { text };
        integer
    }

    /// Skips a value of any depth without recursion.
    pub(super) fn skip(&mut self) -> Result<(), Error> {
        let mut values = serde_json::Deserializer::from_slice(self.rest).into_iter::<IgnoredAny>();
        match values.next() {
            Some(Ok(IgnoredAny)) => self.rest = &self.rest[values.byte_offset()..],
            Some(Err(_)) | None => return Err(self.fail("expected value")),
        }
        Ok(())
    }

    /// Expected number of entries of a list that begins here: a guess, but never more than there is room for.
    ///
    /// Assumes a list of numbers, or of rows that are as long as the first one.
    pub(super) fn expected_entries(&self) -> Option<usize> {
        let text = self.rest.trim_ascii_start();
        // A number takes at least a digit and a comma.
        let n_numbers = |list: &[u8]| 1 + memchr_iter(b',', list).count().min(list.len() / 2);
        let end_of_row = memchr(b']', text)?;
        if text.first() != Some(&b'[') {
            return Some(n_numbers(&text[..end_of_row]));
        }
        let mut end = end_of_row;
        while text[end + 1..].trim_ascii_start().first() != Some(&b']') {
            end += 1 + memchr(b']', &text[end + 1..])?;
        }
        Some(n_numbers(&text[..end]).div_ceil(n_numbers(&text[..end_of_row])))
    }
}
