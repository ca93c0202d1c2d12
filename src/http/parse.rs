//! Bytes into requests: limits, pointers and cancellation the same for every format.

use serde::de::{DeserializeOwned, IgnoredAny};
use serde_json::error::Category;

use super::fields::object;
use super::guarded::{Guard, Stop, shortened};
use super::limits::ParseContext;
use super::plain_json;
use super::problem::{Place, Problem};
use super::slug::Slug;
use crate::numerics::error::NumericsError;

/// Parses JSON into a request.
///
/// # Errors
/// 413 for a list that is longer than any request may have, 400 `malformed-json` for what is not JSON, 422 `invalid-request`
/// with a pointer for what is, but not this request.
pub fn parse_json<T: DeserializeOwned>(bytes: &[u8], context: &ParseContext<'_>) -> Result<T, Problem> {
    let guard = Guard::new(context);
    if let Some(request) = plain_json::from_slice(bytes, |json| object(guard.around(json))) {
        return Ok(request);
    }
    if let Some(stop) = guard.stop() {
        return Err(stopped(stop, &guard, context));
    }
    let guard = Guard::asking_for_any(context);
    let mut deserializer = serde_json::Deserializer::from_slice(bytes);
    let parsed =
        object(guard.around(&mut deserializer)).and_then(|request| deserializer.end().map(|()| request));
    parsed.map_err(|error| refusal(&error, &guard, context, bytes))
}

/// The problem of a parse that failed, in a document whose JSON is this text.
pub(super) fn refusal(
    error: &serde_json::Error,
    guard: &Guard<'_>,
    context: &ParseContext<'_>,
    text: &[u8],
) -> Problem {
    if let Some(stop) = guard.stop() {
        return stopped(stop, guard, context);
    }
    match error.classify() {
        Category::Syntax | Category::Eof | Category::Io => malformed_json(error),
        // The type error came first, but the rest may not even be JSON.
        Category::Data => match serde_json::from_slice::<IgnoredAny>(text) {
            Err(error) => malformed_json(&error),
            Ok(IgnoredAny) => {
                let message = error.to_string();
                // The position in bytes says less than the pointer.
                let message = message.rsplit_once(" at line ").map_or(message.as_str(), |(text, _)| text);
                Problem::invalid_request(guard.pointer(), shortened(message))
            }
        },
    }
}

fn stopped(stop: Stop, guard: &Guard<'_>, context: &ParseContext<'_>) -> Problem {
    match stop {
        Stop::Cancelled => Problem::from_numerics(NumericsError::Cancelled, Place::REQUEST),
        Stop::TooLarge(excess) => context.too_large(excess, &guard.pointer()),
    }
}

/// 400 for what is not JSON.
fn malformed_json(error: &serde_json::Error) -> Problem {
    Problem::new(Slug::MalformedJson, error.to_string())
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
        let problem = parse_json::<Request>(text.as_bytes(), &ParseContext::UNLIMITED).unwrap_err();
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
        let request: Request =
            parse_json(br#"{"points": [[1, 2], [3, 4]], "alpha": 1}"#, &ParseContext::UNLIMITED).unwrap();
        assert_eq!(request.points.coordinates, [1.0, 2.0, 3.0, 4.0]);
        assert_eq!((request.points.dimension, request.points.ragged, request.alpha), (2, None, Some(1.0)));
        let request: Request =
            parse_json(br#"{"points": [[1, 2], [3], [4, 5], []]}"#, &ParseContext::UNLIMITED).unwrap();
        assert_eq!((request.points.coordinates.len(), request.points.ragged), (2, Some((1, 1))));
    }
}
