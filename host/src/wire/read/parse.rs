//! Parsing of bodies into requests, with the same limits, pointers and cancellation for every format.

use std::borrow::Cow;

use serde::de::{DeserializeOwned, IgnoredAny};
use serde_json::Error;

use super::limits::ParseContext;
use super::reader::{MAX_NESTING, NamedTable, Reader, Stop, read, shortened};
use super::renamed::RenamedWord;
use crate::problem::Problem;
use crate::problem::catalogue;

/// A body that is about to be read as a request: a JSON text, and the numbers that are not in it.
pub struct Document<'a> {
    text: Cow<'a, [u8]>,
    /// `None` if numbers are in the text.
    tables: Option<Vec<NamedTable<'a>>>,
}

/// A request `T`, and a member `operation` that its body had beside the members of `T`.
#[derive(Debug)]
pub struct WithOperation<T> {
    pub operation: Option<String>,
    pub request: T,
}

impl<'a> Document<'a> {
    /// A body in JSON.
    pub fn json(text: &'a [u8]) -> Self {
        Self { text: text.into(), tables: None }
    }

    /// A body whose numbers are in tables, where those of the same object stand side by side. `text` is the
    /// JSON of all other members.
    pub(super) fn with_tables(text: Cow<'a, [u8]>, tables: Vec<NamedTable<'a>>) -> Self {
        Self { text, tables: Some(tables) }
    }

    /// Parses the body into a request.
    ///
    /// # Errors
    /// - 413 for a list that is longer than any request may have.
    /// - 400 `malformed-json` for text that is not JSON, and `malformed-body` for data that end early.
    /// - 422 `invalid-request` with a pointer for a well-formed body that is not a `T`.
    pub fn parse<T: DeserializeOwned>(mut self, context: &ParseContext<'_>) -> Result<T, Problem> {
        let mut reader = self.reader(context);
        read(&mut reader).map_err(|error| refusal(&error, reader, context))
    }

    /// Parses the body into a request, and into the member `operation` that may stand beside those of the
    /// request.
    ///
    /// # Errors
    /// Returns the errors of [`Document::parse`].
    pub fn parse_with_operation<T: DeserializeOwned>(
        mut self,
        context: &ParseContext<'_>,
    ) -> Result<WithOperation<T>, Problem> {
        let mut reader = self.reader(context).without_operation();
        match read(&mut reader) {
            Ok(request) => Ok(WithOperation { operation: reader.into_operation(), request }),
            Err(error) => Err(refusal(&error, reader, context)),
        }
    }

    fn reader<'r>(&'r mut self, context: &'r ParseContext<'_>) -> Reader<'r> {
        let reader = Reader::new(&self.text, context);
        match self.tables.take() {
            Some(tables) => reader.with_tables(tables),
            None => reader,
        }
    }
}

/// Parses JSON into a request.
///
/// # Errors
/// Returns the errors of [`Document::parse`].
pub fn parse_json<T: DeserializeOwned>(bytes: &[u8], context: &ParseContext<'_>) -> Result<T, Problem> {
    Document::json(bytes).parse(context)
}

/// Returns the problem of a failed parse.
///
/// The first error may be one of type although the text is not JSON further on. So it is read again to its
/// end by `serde_json`, which also words what is wrong with it.
#[cold]
fn refusal(error: &Error, reader: Reader<'_>, context: &ParseContext<'_>) -> Problem {
    let failure = reader.into_failure();
    match failure.stop {
        Some(Stop::Cancelled) => return Problem::cancelled(),
        Some(Stop::TooLarge(excess)) => return context.lists.too_large(excess, &failure.pointer),
        Some(Stop::Malformed(problem)) => return *problem,
        None => {}
    }
    if nests_too_deep(failure.text) {
        return malformed_json(format!("lists and objects are nested more than {MAX_NESTING} deep"));
    }
    match (serde_json::from_slice::<IgnoredAny>(failure.text), failure.flaw) {
        (Err(error), _) => malformed_json(error.to_string()),
        (Ok(IgnoredAny), Some(flaw)) => malformed_json(flaw),
        (Ok(IgnoredAny), None) => {
            let detail = error.to_string();
            let renamed = RenamedWord::refusal(context.renamed, &detail).unwrap_or(detail);
            Problem::invalid_request(failure.pointer, shortened(renamed.into()))
        }
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

/// 400 for text that is not JSON.
fn malformed_json(detail: String) -> Problem {
    Problem::new(catalogue::MALFORMED_JSON, detail)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;
    use std::sync::atomic::Ordering::Relaxed;

    use super::*;
    use crate::problem::slug::Slug;
    use crate::testing::{lists, unlimited};
    use crate::wire::read::points::Points;
    use gramian_observer::{Observer, Stage};

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
        let problem = parse_json::<Request>(text.as_bytes(), &unlimited()).unwrap_err();
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
            assert_eq!(refusal(text).0, catalogue::MALFORMED_JSON, "{text}");
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
            assert_eq!(refusal(text), (catalogue::INVALID_REQUEST, pointer.to_owned()), "{text}");
        }
    }

    #[test]
    fn objects_are_objects_and_words_are_words() {
        let with = |member: &str| format!(r#"{{"points": [[1]], {member}}}"#);
        let text = with(r#""family": "gauss", "vary": [{"max": 2}]"#);
        let request: Request = parse_json(text.as_bytes(), &unlimited()).unwrap();
        assert!(matches!(request.family, Some(Family::Gauss)) && request.vary.unwrap()[0].max == 2.0);
        for (member, pointer) in [
            (r#""family": null"#, "/family"),
            (r#""family": {"gauss": null}"#, "/family"),
            (r#""family": ["gauss"]"#, "/family"),
            (r#""vary": null"#, "/vary"),
            (r#""vary": [null]"#, "/vary/0"),
            (r#""vary": [[2]]"#, "/vary/0"),
        ] {
            assert_eq!(refusal(&with(member)), (catalogue::INVALID_REQUEST, pointer.to_owned()), "{member}");
        }
    }

    #[test]
    fn points_are_flat_and_remember_the_first_ragged_row() {
        let request: Request =
            parse_json(br#"{"points": [[1, 2], [3, 4]], "alpha": 1}"#, &unlimited()).unwrap();
        assert_eq!(request.points.coordinates, [1.0, 2.0, 3.0, 4.0]);
        assert_eq!((request.points.dimension, request.points.ragged, request.alpha), (2, None, Some(1.0)));
        let request: Request = parse_json(br#"{"points": [[1, 2], [3], [4, 5], []]}"#, &unlimited()).unwrap();
        assert_eq!((request.points.coordinates.len(), request.points.ragged), (2, Some((1, 1))));
    }

    #[test]
    fn room_for_points_is_made_once_and_never_for_more_than_there_can_be() {
        let room = |text: &str| {
            let request: Request = parse_json(text.as_bytes(), &unlimited()).unwrap();
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
        let lists = lists(3, 2, 2);
        let context = ParseContext { lists: &lists, ..unlimited() };
        // A text with an escape is parsed by `serde_json`.
        for alpha in [r#""alpha""#, r#""\u0061lpha""#] {
            let parse = |points: &str| {
                parse_json::<Request>(format!(r#"{{{alpha}: 1, "points": {points}}}"#).as_bytes(), &context)
            };
            for points in ["[[1, 2], [3, 4], [5, 6]]", "[]", "[[], [], []]", "[[1, 2], [3]]"] {
                assert!(parse(points).is_ok(), "{points}");
            }
            for (points, limit, required, hint) in [
                ("[[1], [2], [3], [4]]", 3, 4, "send fewer"),
                ("[[1], [2, 3], [], [], [], []]", 3, 6, "send fewer"),
                ("[[1, 2, 3]]", 2, 3, "1 rows are too wide"),
                ("[[1, 2], [1, 2, 3, 4]]", 2, 4, "2 rows are too wide"),
                ("[[1], [2], [3, 4, 5]]", 2, 3, "3 rows are too wide"),
                ("[[1], [2], [3], [4, 5, 6]]", 3, 4, "send fewer"),
            ] {
                let problem = parse(points).unwrap_err();
                let document = serde_json::to_value(problem.document("")).unwrap();
                assert_eq!(problem.slug(), catalogue::PROBLEM_TOO_LARGE, "{points}");
                assert_eq!((&document["limit"], &document["required"]), (&limit.into(), &required.into()));
                assert_eq!(document["errors"][0]["pointer"], "/points");
                assert_eq!(document["errors"][0]["detail"], document["detail"]);
                assert!(document["detail"].as_str().unwrap().contains(hint), "{points}: {document}");
            }
            for points in [r#"[[1], [2], [3], ["4"]]"#, "[[1], [2], [3], 4, null]"] {
                assert_eq!(parse(points).unwrap_err().slug(), catalogue::INVALID_REQUEST, "{points}");
            }
            assert_eq!(parse("[[1], [2], [3], [4]").unwrap_err().slug(), catalogue::MALFORMED_JSON);
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
                    let lists = lists(max_points, 1, 2);
                    let context = ParseContext { lists: &lists, renamed: &[], observer: &observer };
                    let problem = parse_json::<Request>(text.as_bytes(), &context).unwrap_err();
                    assert_eq!(problem.slug(), catalogue::DEADLINE_EXCEEDED);
                }
            }
            let patient = Leaving(AtomicUsize::new(1000));
            let context = ParseContext { observer: &patient, ..unlimited() };
            assert_eq!(parse_json::<Request>(text.as_bytes(), &context).unwrap().points.n_rows, 100_001);
            assert!(patient.0.load(Relaxed) < 1000 - 30);
        }
    }
}
