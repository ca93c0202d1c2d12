//! A fast parser for usual requests, mainly lists of numbers: 1.5 times as fast as `serde_json`
//! (`benches/bodies.rs`).
//!
//! It either accepts a text or leaves it to `serde_json`, which then parses the text again and words the
//! error. So this parser needs no error messages, no string escapes and no recovery. It must accept nothing
//! that `serde_json` refuses, and must read the same values. A property test checks both. Numbers are parsed
//! with the algorithm of Lemire, "Number parsing at a gigabyte per second" (2021), which rounds correctly.

use std::fmt;

use memchr::{memchr, memchr_iter};
use serde::de::value::BorrowedStrDeserializer;
use serde::de::{DeserializeSeed, Deserializer, MapAccess, SeqAccess, Visitor};
use serde::forward_to_deserialize_any;

/// Reads a value that spans a whole text. `None` leaves the text to `serde_json`.
pub fn from_slice<'de, T>(
    text: &'de [u8],
    read: impl FnOnce(&mut PlainJson<'de>) -> Result<T, Unknown>,
) -> Option<T> {
    let mut json = PlainJson { rest: text };
    let value = read(&mut json).ok()?;
    json.skip_whitespace();
    json.rest.is_empty().then_some(value)
}

/// Error of the fast parser: the text is not plain, not JSON, or not of the requested type.
#[derive(Debug)]
pub struct Unknown;

impl fmt::Display for Unknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("not plain")
    }
}

impl std::error::Error for Unknown {}

impl serde::de::Error for Unknown {
    fn custom<T: fmt::Display>(_message: T) -> Self {
        Self
    }
}

/// The unread rest of a text.
pub struct PlainJson<'de> {
    rest: &'de [u8],
}

impl<'de> PlainJson<'de> {
    fn skip_whitespace(&mut self) {
        while let [b' ' | b'\n' | b'\r' | b'\t', rest @ ..] = self.rest {
            self.rest = rest;
        }
    }

    /// The next byte after whitespace.
    fn peek(&mut self) -> Option<u8> {
        self.skip_whitespace();
        self.rest.first().copied()
    }

    fn take(&mut self, byte: u8) -> Result<(), Unknown> {
        let found = self.peek();
        self.take_known(found == Some(byte))
    }

    fn take_known(&mut self, is_known: bool) -> Result<(), Unknown> {
        if !is_known {
            return Err(Unknown);
        }
        self.rest = &self.rest[1..];
        Ok(())
    }

    /// Reads a literal such as `true`. The caller's next step checks that the literal ends there.
    fn word(&mut self, word: &[u8]) -> Result<(), Unknown> {
        self.rest = self.rest.strip_prefix(word).ok_or(Unknown)?;
        Ok(())
    }

    fn string(&mut self) -> Result<&'de str, Unknown> {
        self.take(b'"')?;
        let end =
            self.rest.iter().position(|&byte| byte == b'"' || byte == b'\\' || byte < b' ').ok_or(Unknown)?;
        let (string, rest) = self.rest.split_at(end);
        self.rest = rest;
        self.take_known(rest.first() == Some(&b'"'))?;
        str::from_utf8(string).map_err(|_| Unknown)
    }

    /// Reads a number by the grammar of JSON, which is narrower than that of the library.
    ///
    /// There is no leading plus or zero, digits stand on both sides of the point, and `inf` and `nan` are
    /// refused.
    fn number(&mut self) -> Result<f64, Unknown> {
        let text = self.rest;
        let digits = text.strip_prefix(b"-").unwrap_or(text);
        let is_integer_part = match digits {
            [b'0', next, ..] => !next.is_ascii_digit(),
            [first, ..] => first.is_ascii_digit(),
            [] => false,
        };
        let (x, length) = fast_float2::parse_partial::<f64, _>(text).map_err(|_| Unknown)?;
        let fraction =
            digits[..length - (text.len() - digits.len())].iter().position(|&byte| !byte.is_ascii_digit());
        let is_fraction = match fraction {
            Some(at) if digits[at] == b'.' => digits.get(at + 1).is_some_and(u8::is_ascii_digit),
            Some(_) | None => true,
        };
        self.rest = &text[length..];
        if is_integer_part && is_fraction && x.is_finite() { Ok(x) } else { Err(Unknown) }
    }

    /// Reads a number without fraction and exponent, if there is one here.
    fn integer(&self) -> Option<(u64, &'de [u8])> {
        let length = self.rest.iter().position(|byte| !byte.is_ascii_digit())?;
        let (digits, rest) = self.rest.split_at(length);
        let has_leading_zero = length > 1 && digits[0] == b'0';
        if has_leading_zero || matches!(rest[0], b'.' | b'e' | b'E') {
            return None;
        }
        str::from_utf8(digits).ok()?.parse().ok().map(|x| (x, rest))
    }
}

impl<'de> Deserializer<'de> for &mut PlainJson<'de> {
    type Error = Unknown;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unknown> {
        match self.peek().ok_or(Unknown)? {
            b'{' => {
                self.take(b'{')?;
                visitor.visit_map(Entries { json: self, is_first: true })
            }
            b'[' => {
                self.take(b'[')?;
                visitor.visit_seq(Entries { json: self, is_first: true })
            }
            b'"' => visitor.visit_borrowed_str(self.string()?),
            b't' => self.word(b"true").and_then(|()| visitor.visit_bool(true)),
            b'f' => self.word(b"false").and_then(|()| visitor.visit_bool(false)),
            b'n' => self.word(b"null").and_then(|()| visitor.visit_unit()),
            _ => match self.integer() {
                Some((x, rest)) => {
                    self.rest = rest;
                    visitor.visit_u64(x)
                }
                None => visitor.visit_f64(self.number()?),
            },
        }
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Unknown> {
        self.skip_whitespace();
        visitor.visit_f64(self.number()?)
    }

    /// Refused, because skipping a value would recurse as deep as the text nests. Every other visitor
    /// recurses only as deep as its type.
    fn deserialize_ignored_any<V: Visitor<'de>>(self, _visitor: V) -> Result<V::Value, Unknown> {
        Err(Unknown)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map struct enum identifier
    }
}

/// The entries of a list or an object.
struct Entries<'a, 'de> {
    json: &'a mut PlainJson<'de>,
    is_first: bool,
}

impl Entries<'_, '_> {
    /// Whether another entry follows. Consumes the comma before it, or the closing bracket.
    fn goes_on(&mut self, closing: u8) -> Result<bool, Unknown> {
        let next = self.json.peek();
        if next == Some(closing) {
            self.json.take_known(true)?;
            return Ok(false);
        }
        if !std::mem::take(&mut self.is_first) {
            self.json.take_known(next == Some(b','))?;
        }
        Ok(true)
    }
}

impl<'de> SeqAccess<'de> for Entries<'_, 'de> {
    type Error = Unknown;

    #[inline(always)]
    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, Unknown> {
        if !self.goes_on(b']')? {
            return Ok(None);
        }
        seed.deserialize(&mut *self.json).map(Some)
    }

    /// A guess, never more than the number of entries that the text has room for.
    fn size_hint(&self) -> Option<usize> {
        if self.is_first { expected_entries(self.json.rest) } else { None }
    }
}

/// Expected number of entries of a list that begins here.
///
/// Assumes a list of numbers, or of rows that are as long as the first one.
fn expected_entries(text: &[u8]) -> Option<usize> {
    let text = text.trim_ascii_start();
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

impl<'de> MapAccess<'de> for Entries<'_, 'de> {
    type Error = Unknown;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Unknown> {
        if !self.goes_on(b'}')? {
            return Ok(None);
        }
        let name = self.json.string()?;
        self.json.take(b':')?;
        seed.deserialize(BorrowedStrDeserializer::new(name)).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Unknown> {
        seed.deserialize(&mut *self.json)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde::Deserialize;

    use super::*;
    use crate::http::wire::read::guarded::Guard;
    use crate::http::wire::read::limits::ParseContext;
    use crate::http::wire::read::points::Points;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Request {
        points: Points,
        values: Option<Vec<f64>>,
        name: Option<String>,
        count: Option<u8>,
        is_plain: Option<bool>,
    }

    /// All values that were read, to the last bit.
    fn described(request: &Request) -> String {
        let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        let Request { points, values, name, count, is_plain } = request;
        let shape = (points.dimension, points.ragged);
        let values = values.as_deref().map(bits);
        format!("{:?} {shape:?} {values:?} {name:?} {count:?} {is_plain:?}", bits(&points.coordinates))
    }

    fn plain(text: &[u8]) -> Option<String> {
        let guard = Guard::new(&ParseContext::UNLIMITED);
        from_slice(text, |json| Request::deserialize(guard.around(json))).as_ref().map(described)
    }

    fn by_serde_json(text: &[u8]) -> Option<String> {
        serde_json::from_slice::<Request>(text).ok().as_ref().map(described)
    }

    #[test]
    fn requests_as_they_usually_are_are_plain() {
        for text in [
            r#"{"points":[[1.5,-2e-3,0],[3,4E+2,1e0]],"values":[0.1,-0.0,12345678901234567890123]}"#,
            " {\n\t\"points\" : [ [ 0.25 , 1 ] ] ,\r\n \"name\" : \"gauss\", \"count\": 7, \"is_plain\": true } ",
            r#"{"points": [], "values": [], "is_plain": false}"#,
            r#"{"points": [[1], [2, 3]], "count": 0}"#,
        ] {
            assert!(plain(text.as_bytes()).is_some(), "{text}");
            assert_eq!(plain(text.as_bytes()), by_serde_json(text.as_bytes()), "{text}");
        }
    }

    #[test]
    fn numbers_that_json_does_not_have_are_not_plain() {
        for number in [
            "01", "-01", "00", "+1", ".5", "-.5", "1.", "1.e3", "1e", "1e+", "-", "--1", "NaN", "nan", "inf",
            "Infinity", "-inf", "1e400", "-1e400", "0x10", "1_000", "1,", ",1", "1 2", "1,,2", "", "1.5.5",
            "1e5e5", "null", "\"1\"",
        ] {
            let values = format!(r#"{{"points": [], "values": [{number}]}}"#);
            let points = format!(r#"{{"points": [[{number}]]}}"#);
            for text in [values, points] {
                assert!(number.is_empty() || by_serde_json(text.as_bytes()).is_none(), "{text}");
                assert!(number.is_empty() || plain(text.as_bytes()).is_none(), "{text}");
            }
        }
        for text in [
            r#"{"points": []"#,
            r#"{"points": []}}"#,
            r#"{"points": []} x"#,
            r#"{"points": [],}"#,
            r#"{"points" []}"#,
            r#"{points: []}"#,
            r#"{"points": [], "points": []}"#,
            r#"{"points": [], "other": 1}"#,
            r#"{"points": [[1}]}"#,
            r#"{"points": [], "count": 256}"#,
            r#"{"points": [], "count": 1.0}"#,
            r#"{"points": [], "count": 01}"#,
            r#"{"points": [], "is_plain": truex}"#,
            r#"{"points": [], "name": "a"#,
            "",
        ] {
            assert_eq!((plain(text.as_bytes()), by_serde_json(text.as_bytes())), (None, None), "{text}");
        }
    }

    /// Numbers of every length and magnitude, written in several ways.
    fn number() -> impl Strategy<Value = String> {
        prop_oneof![
            any::<f64>().prop_filter("finite", |x| x.is_finite()).prop_map(|x| format!("{x:e}")),
            any::<f64>()
                .prop_filter("finite", |x| x.is_finite())
                .prop_map(|x| serde_json::to_string(&x).unwrap()),
            (-1.0..1.0).prop_map(|x: f64| x.to_string()),
            any::<i64>().prop_map(|x| x.to_string()),
            any::<u64>().prop_map(|x| x.to_string()),
            "-?(0|[1-9][0-9]{0,40})(\\.[0-9]{1,60})?([eE][+-]?[0-9]{1,3})?",
        ]
    }

    fn space() -> impl Strategy<Value = String> {
        prop_oneof![4 => Just(String::new()), 1 => "[ \n\r\t]{1,3}"]
    }

    fn document() -> impl Strategy<Value = String> {
        let row = proptest::collection::vec(number(), 0..5);
        let rows = proptest::collection::vec(row, 0..6);
        let values = proptest::collection::vec(number(), 0..6);
        (rows, values, space(), space(), "[a-z\u{e4}\\\\\"]{0,3}").prop_map(|(rows, values, a, b, name)| {
            let list = |entries: &[String]| format!("[{a}{}{b}]", entries.join(&format!("{b},{a}")));
            let rows: Vec<String> = rows.iter().map(|row| list(row)).collect();
            let name = serde_json::to_string(&name).unwrap();
            format!(
                "{a}{{{b}\"points\"{a}:{b}{},\"values\":{a}{},\"name\":{name}{b}}}{a}",
                list(&rows),
                list(&values)
            )
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn what_is_plain_is_read_as_serde_json_reads_it(
            text in document(),
            at in any::<proptest::sample::Index>(),
            byte in proptest::sample::select(&b"0123456789+-.eE[]{},: \"\\nNaIi\x00\xff"[..]),
        ) {
            let mut text = text.into_bytes();
            let expected = by_serde_json(&text);
            let is_escaped = text.contains(&b'\\');
            prop_assert!(is_escaped || plain(&text) == expected);
            // With a byte changed, the text must be read alike by both parsers or be left to serde_json.
            let at = at.index(text.len());
            text[at] = byte;
            let changed = plain(&text);
            prop_assert!(changed.is_none() || changed == by_serde_json(&text), "{}", String::from_utf8_lossy(&text));
        }
    }
}
