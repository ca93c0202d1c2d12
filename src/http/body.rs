//! Bodies in: bytes within the limit, into types, refusals with pointers.

use std::marker::PhantomData;

use serde::de::value::MapAccessDeserializer;
use serde::de::{
    Deserialize, DeserializeOwned, Deserializer, IgnoredAny, IntoDeserializer, MapAccess, SeqAccess, Visitor,
};
use serde_json::error::Category;

use super::compression::decompress;
use super::compute::FLOPS_PER_PARSED_BYTE;
use super::negotiation::{Coding, Format};
use super::plain_json;
use super::problem::Problem;
use super::slug::Slug;
use super::tensors::{parse_npy, parse_safetensors};
use crate::config::Config;

/// Characters of a refused value or name that are repeated to the client.
const MAX_SHOWN_CHARACTERS: usize = 200;

/// A request as it came.
pub struct RequestBody {
    format: Format,
    coding: Coding,
    bytes: Vec<u8>,
    /// Bytes it may have once it is decompressed.
    limit: usize,
}

impl RequestBody {
    pub fn new(format: Format, coding: Coding, bytes: Vec<u8>, limit: usize) -> Self {
        Self { format, coding, bytes, limit }
    }

    /// Bytes that [`RequestBody::parse`] takes beside the body at most: the body unpacked, and the numbers in it, of which the
    /// limits leave so many. A number takes two bytes of JSON at least, its comma included.
    pub fn n_bytes_to_parse(&self, config: &Config) -> usize {
        let plain = self.n_bytes_plain();
        let unpacked = if self.coding == Coding::Identity { 0 } else { plain };
        let n_rows = 4 * config.max_points.saturating_add(config.max_queries);
        let most = n_rows.saturating_mul(config.max_dimension).saturating_mul(size_of::<f64>());
        unpacked + plain.saturating_mul(size_of::<f64>() / 2).min(most)
    }

    /// What parsing costs, in flops.
    pub fn flops_to_parse(&self) -> f64 {
        FLOPS_PER_PARSED_BYTE * self.n_bytes_plain() as f64
    }

    /// Bytes without compression at most.
    fn n_bytes_plain(&self) -> usize {
        match self.coding {
            Coding::Identity => self.bytes.len(),
            // A few bytes of zstd may unpack to any number.
            Coding::Gzip | Coding::Zstd => self.limit,
        }
    }

    /// Decompresses and parses, on the pool.
    ///
    /// # Errors
    /// 413 beyond the limit, 400 for what is not of its format, 422 with a pointer for what is, but not this request.
    pub fn parse<T: DeserializeOwned>(self) -> Result<T, Problem> {
        let bytes = decompress(self.bytes, self.coding, self.limit)?;
        match self.format {
            Format::Json => parse_json(&bytes),
            Format::Safetensors => parse_safetensors(&bytes),
            Format::Npy => parse_npy(&bytes),
        }
    }
}

/// Parses JSON into a request.
///
/// # Errors
/// 400 `malformed-json` for what is not JSON, 422 `invalid-request` with a pointer for what is, but not this request.
pub fn parse_json<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, Problem> {
    if let Some(request) = plain_json::from_slice(bytes, |json| object(json)) {
        return Ok(request);
    }
    let mut deserializer = serde_json::Deserializer::from_slice(bytes);
    let parsed = object(&mut deserializer).and_then(|request| deserializer.end().map(|()| request));
    parsed.map_err(|error| match error.classify() {
        Category::Syntax | Category::Eof | Category::Io => malformed_json(&error),
        // The type error came first, but the rest may not even be JSON.
        Category::Data => match serde_json::from_slice::<IgnoredAny>(bytes) {
            Err(error) => malformed_json(&error),
            Ok(IgnoredAny) => refusal::<T, _>(&mut serde_json::Deserializer::from_slice(bytes), &error),
        },
    })
}

/// 400 for what is not JSON.
pub fn malformed_json(error: &serde_json::Error) -> Problem {
    Problem::new(Slug::MalformedJson, error.to_string())
}

/// 422 with a pointer: parses again, this time tracking the path, so that only refused requests pay for it.
pub fn refusal<'de, T: Deserialize<'de>, D: Deserializer<'de>>(deserializer: D, error: &D::Error) -> Problem {
    let mut track = serde_path_to_error::Track::new();
    let tracked = serde_path_to_error::Deserializer::new(deserializer, &mut track);
    let (pointer, message) = match object::<T, _>(tracked) {
        Ok(_) => (String::new(), error.to_string()),
        Err(error) => (pointer_of(&track.path()), error.to_string()),
    };
    // The position in bytes says less than the pointer.
    let message = message.rsplit_once(" at line ").map_or(message.as_str(), |(text, _)| text);
    Problem::invalid_request(shortened(&pointer), shortened(message))
}

/// Clients may send megabytes where a name or number belongs.
fn shortened(text: &str) -> String {
    match text.char_indices().nth(MAX_SHOWN_CHARACTERS) {
        None => text.to_owned(),
        Some((end, _)) => format!("{}…", &text[..end]),
    }
}

/// RFC 6901: segments behind slashes, `~` as `~0` and `/` as `~1`.
fn pointer_of(path: &serde_path_to_error::Path) -> String {
    use serde_path_to_error::Segment;
    let mut pointer = String::new();
    for segment in path {
        let text = match segment {
            Segment::Seq { index } => index.to_string(),
            Segment::Map { key } => key.replace('~', "~0").replace('/', "~1"),
            Segment::Enum { variant } => variant.clone(),
            Segment::Unknown => continue,
        };
        pointer.push('/');
        pointer.push_str(&text);
    }
    pointer
}

/// For optional fields: absent is `None`, null is refused by the type itself.
///
/// # Errors
/// Those of the type.
pub fn present<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<T>, D::Error> {
    T::deserialize(deserializer).map(Some)
}

/// For fields that are objects: serde would also take an array of their members in order, which is no part of the contract.
///
/// # Errors
/// Those of the type, and anything that is no object.
pub fn object<'de, T: Deserialize<'de>, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    struct ObjectVisitor<T>(PhantomData<T>);

    impl<'de, T: Deserialize<'de>> Visitor<'de> for ObjectVisitor<T> {
        type Value = T;

        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("an object")
        }

        fn visit_map<A: MapAccess<'de>>(self, members: A) -> Result<T, A::Error> {
            T::deserialize(MapAccessDeserializer::new(members))
        }
    }

    deserializer.deserialize_map(ObjectVisitor(PhantomData))
}

/// [`object`] for optional fields.
///
/// # Errors
/// Those of [`object`].
pub fn present_object<'de, T, D>(deserializer: D) -> Result<Option<T>, D::Error>
where
    T: Deserialize<'de>,
    D: Deserializer<'de>,
{
    object(deserializer).map(Some)
}

/// For enumerations: a string and nothing else. serde would take `{"dense": null}` as well, and `serde_json` calls other types
/// a syntax error.
struct Word<T>(T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Word<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct WordVisitor<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for WordVisitor<T> {
            type Value = Word<T>;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a string")
            }

            fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Word<T>, E> {
                T::deserialize(word.into_deserializer()).map(Word)
            }
        }

        deserializer.deserialize_str(WordVisitor(PhantomData))
    }
}

/// For fields that are enumerations.
///
/// # Errors
/// For anything but one of their strings.
pub fn word<'de, T: Deserialize<'de>, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    Word::deserialize(deserializer).map(|Word(word)| word)
}

/// [`word`] for optional fields.
///
/// # Errors
/// Those of [`word`].
pub fn present_word<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<T>, D::Error> {
    word(deserializer).map(Some)
}

/// [`word`] for optional lists.
///
/// # Errors
/// Those of [`word`], with the position in the list.
pub fn present_words<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<Vec<T>>, D::Error> {
    let words = Vec::<Word<T>>::deserialize(deserializer)?;
    Ok(Some(words.into_iter().map(|Word(word)| word).collect()))
}

/// Points as they come: one flat buffer, whatever their number, with the first row that differs in length.
#[derive(Debug, Clone, Default)]
pub struct Points {
    pub coordinates: Vec<f64>,
    pub dimension: usize,
    /// Index and length of the first ragged row, behind which nothing is kept.
    pub ragged: Option<(usize, usize)>,
}

impl<'de> Deserialize<'de> for Points {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(PointsVisitor)
    }
}

struct PointsVisitor;

impl<'de> Visitor<'de> for PointsVisitor {
    type Value = Points;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a list of points")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut rows: A) -> Result<Points, A::Error> {
        let mut points = Points::default();
        let mut n_rows = 0;
        loop {
            let start = points.coordinates.len();
            if rows.next_element_seed(Row(&mut points.coordinates))?.is_none() {
                return Ok(points);
            }
            let length = points.coordinates.len() - start;
            if n_rows == 0 {
                points.dimension = length;
            }
            if points.ragged.is_some() || length != points.dimension {
                points.ragged = points.ragged.or(Some((n_rows, length)));
                points.coordinates.truncate(start);
            }
            n_rows += 1;
        }
    }
}

/// Appends one row.
struct Row<'a>(&'a mut Vec<f64>);

impl<'de> serde::de::DeserializeSeed<'de> for Row<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for Row<'_> {
    type Value = ();

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a point: a list of coordinates")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut coordinates: A) -> Result<(), A::Error> {
        while let Some(x) = coordinates.next_element()? {
            self.0.push(x);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Request {
        points: Points,
        #[serde(default, deserialize_with = "present")]
        alpha: Option<f64>,
    }

    fn refusal(text: &str) -> (Slug, String) {
        let problem = parse_json::<Request>(text.as_bytes()).unwrap_err();
        let document = serde_json::to_value(problem.document("")).unwrap();
        let pointer = document["errors"][0]["pointer"].as_str().unwrap_or("-").to_owned();
        (problem.slug(), pointer)
    }

    #[test]
    fn what_is_not_json_is_malformed() {
        for text in [
            "",
            "{",
            r#"{"points": [[1, 2"#,
            r#"{"points": [[NaN]]}"#,
            r#"{"points": [[1e400]]}"#,
            r#"{"points": [[1]]} x"#,
            r#"{"points": 3, "alpha": "#,
        ] {
            assert_eq!(refusal(text).0, Slug::MalformedJson, "{text}");
        }
    }

    #[test]
    fn what_is_json_but_not_the_request_points_to_the_field() {
        for (text, pointer) in [
            (r#"{"points": [[1, 2], [3, null]]}"#, "/points/1/1"),
            (r#"{"points": [[1, 2], [3, "4"]]}"#, "/points/1/1"),
            (r#"{"points": [1]}"#, "/points/0"),
            (r#"{"points": null}"#, "/points"),
            (r#"{"points": [[1]], "alpha": null}"#, "/alpha"),
            (r#"{"points": [[1]], "a/b": 1}"#, "/a~1b"),
            (r#"{}"#, ""),
            (r#"[]"#, ""),
        ] {
            assert_eq!(refusal(text), (Slug::InvalidRequest, pointer.to_owned()), "{text}");
        }
    }

    #[test]
    fn points_are_flat_and_remember_the_first_ragged_row() {
        let request: Request = parse_json(br#"{"points": [[1, 2], [3, 4]], "alpha": 1}"#).unwrap();
        assert_eq!(request.points.coordinates, [1.0, 2.0, 3.0, 4.0]);
        assert_eq!((request.points.dimension, request.points.ragged, request.alpha), (2, None, Some(1.0)));
        let request: Request = parse_json(br#"{"points": [[1, 2], [3], [4, 5], []]}"#).unwrap();
        assert_eq!((request.points.coordinates.len(), request.points.ragged), (2, Some((1, 1))));
    }
}
