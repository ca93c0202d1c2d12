//! Tests of reading JSON against `serde_json`, and of the member `operation`.

use proptest::prelude::*;
use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::problem::Problem;
use crate::problem::catalogue;
use crate::problem::slug::Slug;
use crate::testing::unlimited;
use crate::wire::read::parse::{Document, WithOperation, parse_json};
use crate::wire::read::points::Points;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Request {
    points: Points,
    values: Option<Vec<f64>>,
    name: Option<String>,
    count: Option<u8>,
    is_open: Option<bool>,
}

/// All values that were read, to the last bit.
fn described(request: &Request) -> String {
    let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    let Request { points, values, name, count, is_open } = request;
    let shape = (points.dimension, points.ragged);
    let values = values.as_deref().map(bits);
    format!("{:?} {shape:?} {values:?} {name:?} {count:?} {is_open:?}", bits(&points.coordinates))
}

fn read(text: &[u8]) -> Option<String> {
    parse_json(text, &unlimited()).ok().as_ref().map(described)
}

fn by_serde_json(text: &[u8]) -> Option<String> {
    serde_json::from_slice::<Request>(text).ok().as_ref().map(described)
}

#[test]
fn requests_as_they_usually_are_are_read() {
    for text in [
        r#"{"points":[[1.5,-2e-3,0],[3,4E+2,1e0]],"values":[0.1,-0.0,12345678901234567890123]}"#,
        " {\n\t\"points\" : [ [ 0.25 , 1 ] ] ,\r\n \"name\" : \"gauss\", \"count\": 7, \"is_open\": true } ",
        r#"{"points": [], "values": [], "is_open": false}"#,
        r#"{"points": [[1], [2, 3]], "count": 0}"#,
    ] {
        assert!(read(text.as_bytes()).is_some(), "{text}");
        assert_eq!(read(text.as_bytes()), by_serde_json(text.as_bytes()), "{text}");
    }
}

#[test]
fn numbers_that_json_does_not_have_are_not_read() {
    for number in [
        "01", "-01", "00", "+1", ".5", "-.5", "1.", "1.e3", "1e", "1e+", "-", "--1", "NaN", "nan", "inf",
        "Infinity", "-inf", "1e400", "-1e400", "0x10", "1_000", "1,", ",1", "1 2", "1,,2", "", "1.5.5",
        "1e5e5", "null", "\"1\"",
    ] {
        let values = format!(r#"{{"points": [], "values": [{number}]}}"#);
        let points = format!(r#"{{"points": [[{number}]]}}"#);
        for text in [values, points] {
            assert!(number.is_empty() || by_serde_json(text.as_bytes()).is_none(), "{text}");
            assert!(number.is_empty() || read(text.as_bytes()).is_none(), "{text}");
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
        r#"{"points": [], "is_open": truex}"#,
        r#"{"points": [], "name": "a"#,
        "",
    ] {
        assert_eq!((read(text.as_bytes()), by_serde_json(text.as_bytes())), (None, None), "{text}");
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
    fn a_text_is_read_or_refused_as_by_serde_json(
        text in document(),
        at in any::<proptest::sample::Index>(),
        byte in proptest::sample::select(&b"0123456789+-.eE[]{},: \"\\nNaIi\x00\xff"[..]),
    ) {
        let mut text = text.into_bytes();
        let expected = by_serde_json(&text);
        prop_assert_eq!(read(&text), expected);
        let at = at.index(text.len());
        text[at] = byte;
        prop_assert_eq!(read(&text), by_serde_json(&text), "{}", String::from_utf8_lossy(&text));
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct WithAlpha {
    alpha: f64,
}

/// A type that skips what it is given.
#[derive(Debug, Deserialize)]
struct Anything {}

fn with_operation<T: DeserializeOwned>(text: &str) -> Result<WithOperation<T>, Problem> {
    Document::json(text.as_bytes()).parse_with_operation(&unlimited())
}

/// Slug, pointer and detail of a problem.
fn described_problem(problem: &Problem) -> (Slug, String, String) {
    let document = serde_json::to_value(problem.document("")).unwrap();
    let text = |value: &serde_json::Value| value.as_str().unwrap_or("-").to_owned();
    (problem.slug(), text(&document["errors"][0]["pointer"]), text(&document["detail"]))
}

#[test]
fn the_operation_may_stand_anywhere_and_once() {
    let read = |text| with_operation::<WithAlpha>(text).map(|read| (read.operation, read.request.alpha));
    let named = Some("normals".to_owned());
    assert_eq!(read(r#"{"operation": "normals", "alpha": 2}"#).unwrap(), (named.clone(), 2.0));
    assert_eq!(read(r#"{"alpha": 2, "operation": "normals"}"#).unwrap(), (named, 2.0));
    assert_eq!(read(r#"{"alpha": 2}"#).unwrap(), (None, 2.0));
    for (text, pointer, detail) in [
        (r#"{"operation": "a", "operation": "b", "alpha": 2}"#, "", "duplicate field `operation`"),
        (r#"{"operation": 3, "alpha": 2}"#, "/operation", "invalid type: integer `3`"),
        (r#"{"operation": "a", "alpha": 2, "beta": 3}"#, "/beta", "unknown field `beta`"),
        (r#"{"operation": "a"}"#, "", "missing field `alpha`"),
        (r#"["operation"]"#, "", "invalid type: sequence, expected an object"),
    ] {
        let (slug, at, told) = described_problem(&read(text).unwrap_err());
        assert_eq!((slug, at.as_str()), (catalogue::INVALID_REQUEST, pointer), "{text}");
        assert!(told.contains(detail), "{told}");
    }
    assert!(parse_json::<WithAlpha>(br#"{"operation": "a", "alpha": 2}"#, &unlimited()).is_err());
}

#[test]
fn only_the_operation_of_the_whole_request_is_taken() {
    #[derive(Debug, Deserialize)]
    struct Outer {
        inner: Vec<Inner>,
    }
    #[derive(Debug, Deserialize)]
    struct Inner {
        operation: String,
    }
    let read = with_operation::<Outer>(r#"{"inner": [{"operation": "a"}], "operation": "b"}"#).unwrap();
    assert_eq!((read.operation.as_deref(), read.request.inner[0].operation.as_str()), (Some("b"), "a"));
    let text = format!(
        r#"{{"x": [1, {{"y": "\u0041]"}}], "operation": "a", "deep": {}{}}}"#,
        "[".repeat(99),
        "]".repeat(99)
    );
    assert_eq!(with_operation::<Anything>(&text).unwrap().operation.unwrap(), "a");
}

#[test]
fn what_is_not_json_is_told_with_its_place() {
    for (text, told) in [
        ("{\"points\": [],\n \"values\": [1,\n  1e400]}", "number out of range at line 3 column 7"),
        (r#"{"points": [], "name": "\ud800"}"#, "unexpected end of hex escape at line 1 column 31"),
        (r#"{"points": [], "name": "a}"#, "EOF while parsing a string at line 1 column 26"),
        (r#"{"points": 3, "name" 4}"#, "expected `:` at line 1 column 22"),
        (r#"{"points": []} 5"#, "trailing characters at line 1 column 16"),
    ] {
        let problem = parse_json::<Request>(text.as_bytes(), &unlimited()).unwrap_err();
        let (slug, _, detail) = described_problem(&problem);
        assert_eq!((slug, detail.as_str()), (catalogue::MALFORMED_JSON, told), "{text}");
    }
}

#[test]
fn lists_are_read_to_their_end() {
    let parse = |text: &str| parse_json::<Vec<[f64; 2]>>(text.as_bytes(), &unlimited());
    assert_eq!(parse("[[1, 2], [3, 4]]").unwrap(), [[1.0, 2.0], [3.0, 4.0]]);
    for text in ["[[1, 2, 3]]", "[[1, 2, [3, 4]]", "[[1]]"] {
        assert!(parse(text).is_err(), "{text}");
    }
}

#[test]
fn numbers_that_no_type_expects_are_named_as_they_are() {
    for (number, told) in [
        ("-7", "invalid type: integer `-7`, expected a string"),
        ("18446744073709551616", "invalid type: floating point `1.844674407370955"),
        ("-0", "invalid type: floating point `-0.0`"),
        ("null", "invalid type: null"),
    ] {
        let text = format!(r#"{{"points": [], "name": {number}}}"#);
        let problem = parse_json::<Request>(text.as_bytes(), &unlimited()).unwrap_err();
        assert!(described_problem(&problem).2.contains(told), "{problem:?}");
    }
}
