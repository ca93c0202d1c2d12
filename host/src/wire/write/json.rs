//! JSON of answers, in which every number is finite.
//!
//! serde_json writes null for NaN and infinity, which breaks clients whose schema has a number there. Answers
//! are therefore written by a formatter that refuses null altogether. [`Nullable`] writes the nulls that the
//! `OpenAPI` document allows.

use std::io;
use std::time::SystemTime;

use axum::http::{HeaderValue, header};
use axum::response::{IntoResponse, Response};
use serde::ser::{Error, Serialize, Serializer};
use serde_json::ser::Formatter;
use serde_json::value::RawValue;

use crate::problem::Problem;

/// The value contains a null: a number that is not finite, or an optional member that is not left out.
#[derive(Debug)]
pub struct HasNull;

/// Returns the JSON text of a value.
///
/// # Errors
/// [`HasNull`] where serde_json would write null, except for [`Nullable`].
pub fn to_vec(value: &impl Serialize) -> Result<Vec<u8>, HasNull> {
    let mut text = Vec::with_capacity(128);
    let mut serializer = serde_json::Serializer::with_formatter(&mut text, WithoutNull);
    match value.serialize(&mut serializer) {
        Ok(()) => Ok(text),
        Err(_) => Err(HasNull),
    }
}

/// A formatter for compact JSON that refuses null.
struct WithoutNull;

impl Formatter for WithoutNull {
    fn write_null<W: ?Sized + io::Write>(&mut self, _: &mut W) -> io::Result<()> {
        Err(io::Error::other("null in an answer"))
    }
}

/// A member that is a number or null in the `OpenAPI` document.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nullable(pub Option<f64>);

impl Serialize for Nullable {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            Some(number) => serializer.serialize_f64(number),
            // Raw text bypasses the formatter.
            None => {
                serde_json::from_str::<&RawValue>("null").map_err(S::Error::custom)?.serialize(serializer)
            }
        }
    }
}

/// Returns a time as answers have it: RFC 3339 in UTC, with milliseconds.
pub fn timestamp(time: SystemTime) -> String {
    humantime::format_rfc3339_millis(time).to_string()
}

/// A JSON answer whose numbers come from the server itself.
///
/// A number that is not finite is a bug, answered with 500. Answers computed from numbers of the client are
/// [`super::answer::Answer`]s, which refuse the request instead.
pub struct Json<T>(pub T);

impl<T: Serialize> IntoResponse for Json<T> {
    fn into_response(self) -> Response {
        let Ok(text) = to_vec(&self.0) else {
            tracing::error!(answer = std::any::type_name::<T>(), "an answer has a null");
            return Problem::internal().into_response();
        };
        ([(header::CONTENT_TYPE, HeaderValue::from_static("application/json"))], text).into_response()
    }
}

#[cfg(test)]
mod tests {
    use axum::http::StatusCode;
    use serde_json::json;

    use super::*;

    #[derive(serde::Serialize)]
    struct Sample {
        list: Vec<f64>,
        nested: Vec<[Option<f64>; 1]>,
        entries: Vec<Nullable>,
    }

    fn sample(list: f64, nested: Option<f64>, entry: Option<f64>) -> Sample {
        Sample { list: vec![1.0, list], nested: vec![[nested]], entries: vec![Nullable(entry)] }
    }

    #[test]
    fn finite_numbers_are_written_as_serde_json_has_them_and_nulls_only_where_they_are_meant() {
        let value = sample(5e-324, Some(-0.0), None);
        let text = String::from_utf8(to_vec(&value).unwrap()).unwrap();
        assert_eq!(text, r#"{"list":[1.0,5e-324],"nested":[[-0.0]],"entries":[null]}"#);
        assert_eq!(text, serde_json::to_string(&value).unwrap());
    }

    #[test]
    fn a_number_that_is_not_finite_is_refused_wherever_it_is() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(to_vec(&sample(bad, Some(1.0), None)).is_err());
            assert!(to_vec(&sample(1.0, Some(bad), None)).is_err());
            assert!(to_vec(&sample(1.0, Some(1.0), Some(bad))).is_err());
            assert!(to_vec(&bad).is_err() && to_vec(&(bad as f32)).is_err());
        }
        // An optional member is left out or is a Nullable.
        assert!(to_vec(&sample(1.0, None, None)).is_err());
        assert!(to_vec(&json!({"deep": [{"null": null}]})).is_err());
    }

    #[test]
    fn a_number_of_the_server_that_is_not_finite_is_an_internal_error() {
        assert_eq!(Json(vec![1.0]).into_response().status(), StatusCode::OK);
        assert_eq!(Json(vec![f64::NAN]).into_response().status(), StatusCode::INTERNAL_SERVER_ERROR);
    }
}
