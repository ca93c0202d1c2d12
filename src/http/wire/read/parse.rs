//! Parsing of bytes into requests, with the same limits, pointers and cancellation for every format.

use serde::de::{DeserializeOwned, IgnoredAny};
use serde_json::error::Category;

use super::guarded::{Guard, Stop, shortened};
use super::limits::ParseContext;
use super::plain_json;
use crate::http::problem::slug::Slug;
use crate::http::problem::{Pointers, Problem};
use gramian_numerics::error::NumericsError;

/// Deepest nesting of lists and objects, the limit of `serde_json`.
const MAX_NESTING: usize = 128;

/// Parses JSON into a request.
///
/// # Errors
/// - 413 for a list that is longer than any request may have.
/// - 400 `malformed-json` for text that is not JSON.
/// - 422 `invalid-request` with a pointer for JSON that is not a `T`.
pub fn parse_json<T: DeserializeOwned>(bytes: &[u8], context: &ParseContext<'_>) -> Result<T, Problem> {
    let guard = Guard::new(context);
    if let Some(request) = plain_json::from_slice(bytes, |json| T::deserialize(guard.around(json))) {
        return Ok(request);
    }
    if let Some(stop) = guard.stop() {
        return Err(stopped(stop, &guard, context));
    }
    let guard = Guard::asking_for_any(context);
    let mut deserializer = serde_json::Deserializer::from_slice(bytes);
    let parsed = T::deserialize(guard.around(&mut deserializer))
        .and_then(|request| deserializer.end().map(|()| request));
    parsed.map_err(|error| refusal(&error, &guard, context, bytes))
}

/// Returns the problem of a failed parse. `text` is the JSON of the document.
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
        Category::Data if nests_too_deep(text) => {
            let detail = format!("lists and objects are nested more than {MAX_NESTING} deep");
            Problem::new(Slug::MalformedJson, detail)
        }
        // The type error came first, but the rest of the text may still be malformed JSON.
        Category::Data => match serde_json::from_slice::<IgnoredAny>(text) {
            Err(error) => malformed_json(&error),
            Ok(IgnoredAny) => {
                let message = error.to_string();
                // The pointer says more than the position in bytes.
                let message = message.rsplit_once(" at line ").map_or(message.as_str(), |(text, _)| text);
                Problem::invalid_request(guard.pointer(), shortened(message))
            }
        },
    }
}

/// Whether a text nests lists and objects deeper than `serde_json` parses.
///
/// Checked before the text is skipped over: while skipping, `serde_json` has no depth limit and records every
/// open list and object.
fn nests_too_deep(text: &[u8]) -> bool {
    let (mut depth, mut is_text, mut is_escaped) = (0_usize, false, false);
    for byte in text {
        match byte {
            _ if is_escaped => is_escaped = false,
            b'\\' => is_escaped = is_text,
            b'"' => is_text = !is_text,
            b'[' | b'{' if !is_text => depth += 1,
            b']' | b'}' if !is_text => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > MAX_NESTING {
            return true;
        }
    }
    false
}

fn stopped(stop: Stop, guard: &Guard<'_>, context: &ParseContext<'_>) -> Problem {
    match stop {
        Stop::Cancelled => Problem::from_numerics(NumericsError::Cancelled, Pointers::REQUEST),
        Stop::TooLarge(excess) => context.too_large(excess, &guard.pointer()),
    }
}

/// 400 for text that is not JSON.
fn malformed_json(error: &serde_json::Error) -> Problem {
    Problem::new(Slug::MalformedJson, error.to_string())
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;
    use std::sync::atomic::Ordering::Relaxed;

    use super::*;
    use crate::http::wire::read::points::Points;
    use gramian_numerics::observer::{Observer, Stage};

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Request {
        points: Points,
        alpha: Option<f64>,
        family: Option<Family>,
        vary: Option<Vec<Bounds>>,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(rename_all = "snake_case")]
    enum Family {
        Gauss,
    }

    #[derive(Debug, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Bounds {
        max: f64,
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
            &format!(r#"{{"points": {}{}}}"#, "[".repeat(128), "]".repeat(128)),
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
            (&format!(r#"{{"points": "\"[{}"}}"#, "[".repeat(200)), "/points"),
            (&format!(r#"{{"points": {}{}}}"#, "[".repeat(127), "]".repeat(127)), "/points/0/0"),
            (r#"{}"#, ""),
            (r#"[]"#, ""),
        ] {
            assert_eq!(refusal(text), (Slug::InvalidRequest, pointer.to_owned()), "{text}");
        }
    }

    #[test]
    fn objects_are_objects_and_words_are_words() {
        let with = |member: &str| format!(r#"{{"points": [[1]], {member}}}"#);
        let text = with(r#""family": "gauss", "vary": [{"max": 2}]"#);
        let request: Request = parse_json(text.as_bytes(), &ParseContext::UNLIMITED).unwrap();
        assert!(matches!(request.family, Some(Family::Gauss)) && request.vary.unwrap()[0].max == 2.0);
        for (member, pointer) in [
            (r#""family": null"#, "/family"),
            (r#""family": {"gauss": null}"#, "/family"),
            (r#""family": ["gauss"]"#, "/family"),
            (r#""vary": null"#, "/vary"),
            (r#""vary": [null]"#, "/vary/0"),
            (r#""vary": [[2]]"#, "/vary/0"),
        ] {
            assert_eq!(refusal(&with(member)), (Slug::InvalidRequest, pointer.to_owned()), "{member}");
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

    #[test]
    fn room_for_points_is_made_once_and_never_for_more_than_there_can_be() {
        let room = |text: &str| {
            let request: Request = parse_json(text.as_bytes(), &ParseContext::UNLIMITED).unwrap();
            (request.points.coordinates.len(), request.points.coordinates.capacity())
        };
        for n in [2, 7, 1000] {
            let rows = vec!["[0.25, -1e3 ,\n7]"; n].join(" ,");
            assert_eq!(room(&format!(r#"{{"alpha": 1, "points": [ {rows} ] }}"#)), (3 * n, 3 * n));
        }
        // Rows whose length differs from that of the first row. Such requests are refused later.
        let (_, capacity) = room(&format!(r#"{{"points": [[1, 2, 3]{}]}}"#, ",[]".repeat(1000)));
        assert!(capacity <= 1006, "{capacity}");
        let (_, capacity) = room(&format!(r#"{{"points": [[]{}]}}"#, ",[1]".repeat(1000)));
        assert!(capacity <= 1006, "{capacity}");
    }

    #[test]
    fn lists_may_be_as_long_as_the_limits_and_no_longer() {
        let context =
            ParseContext { max_points: 3, max_queries: 2, max_dimension: 2, ..ParseContext::UNLIMITED };
        // A text with an escape is parsed by `serde_json`.
        for alpha in [r#""alpha""#, r#""\u0061lpha""#] {
            let parse = |points: &str| {
                parse_json::<Request>(format!(r#"{{{alpha}: 1, "points": {points}}}"#).as_bytes(), &context)
            };
            for points in ["[[1, 2], [3, 4], [5, 6]]", "[]", "[[], [], []]", "[[1, 2], [3]]"] {
                assert!(parse(points).is_ok(), "{points}");
            }
            for (points, limit, required, hint) in [
                ("[[1], [2], [3], [4]]", 3, 4, "thin the cloud"),
                ("[[1], [2, 3], [], [], [], []]", 3, 6, "thin the cloud"),
                ("[[1, 2, 3]]", 2, 3, "1 row of 3 coordinates; transpose"),
                ("[[1, 2], [1, 2, 3, 4]]", 2, 4, "2 rows of 4 coordinates; transpose"),
                ("[[1], [2], [3, 4, 5]]", 2, 3, "fewer dimensions"),
                ("[[1], [2], [3], [4, 5, 6]]", 3, 4, "thin the cloud"),
            ] {
                let problem = parse(points).unwrap_err();
                let document = serde_json::to_value(problem.document("")).unwrap();
                assert_eq!(problem.slug(), Slug::ProblemTooLarge, "{points}");
                assert_eq!((&document["limit"], &document["required"]), (&limit.into(), &required.into()));
                assert_eq!(document["errors"][0]["pointer"], "/points");
                assert_eq!(document["errors"][0]["detail"], document["detail"]);
                assert!(document["detail"].as_str().unwrap().contains(hint), "{points}: {document}");
            }
            for points in [r#"[[1], [2], [3], ["4"]]"#, "[[1], [2], [3], 4, null]"] {
                assert_eq!(parse(points).unwrap_err().slug(), Slug::InvalidRequest, "{points}");
            }
            assert_eq!(parse("[[1], [2], [3], [4]").unwrap_err().slug(), Slug::MalformedJson);
        }
    }

    /// An observer whose client leaves after a number of cancellation checks.
    struct Leaving(AtomicUsize);

    impl Observer for Leaving {
        fn enter(&self, _stage: Stage) {}

        fn is_cancelled(&self) -> bool {
            self.0.fetch_update(Relaxed, Relaxed, |n| n.checked_sub(1)).is_err()
        }
    }

    #[test]
    fn parsing_stops_when_nobody_waits() {
        for text in [r#"{"points": [[0.5, 1]POINTS]}"#, r#"{"p\u006fints": [[0.5, 1]POINTS]}"#] {
            let text = text.replace("POINTS", &",[0.5, 1]".repeat(100_000));
            for n_asked in [0, 1, 5] {
                let observer = Leaving(AtomicUsize::new(n_asked));
                // Cancellation also works while entries are only counted.
                for max_points in [usize::MAX, 10] {
                    let context = ParseContext { max_points, observer: &observer, ..ParseContext::UNLIMITED };
                    let problem = parse_json::<Request>(text.as_bytes(), &context).unwrap_err();
                    assert_eq!(problem.slug(), Slug::DeadlineExceeded);
                }
            }
            let patient = Leaving(AtomicUsize::new(1000));
            let context = ParseContext { observer: &patient, ..ParseContext::UNLIMITED };
            assert_eq!(parse_json::<Request>(text.as_bytes(), &context).unwrap().points.n_rows, 100_001);
            assert!(patient.0.load(Relaxed) < 1000 - 30);
        }
    }
}
