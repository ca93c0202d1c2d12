//! JSON into requests, and refusals with pointers.

use serde::de::{Deserialize, DeserializeOwned, Deserializer, IgnoredAny};
use serde_json::error::Category;

use super::fields::object;
use super::plain_json;
use super::problem::Problem;
use super::slug::Slug;

/// Characters of a refused value or name that are repeated to the client.
const MAX_SHOWN_CHARACTERS: usize = 200;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::http::fields::present;
    use crate::http::points::Points;

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
