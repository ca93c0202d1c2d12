//! The OpenAPI document as a contract: every answer that a test receives is checked against it.
//!
//! `support::receive` calls [`check`] for every request of a `Server`, so no test can forget it. An answer is
//! right under three conditions:
//!
//! - The document has its path, method and status.
//! - Its media type is declared, and its body has the declared form, with no member that the document does
//!   not name.
//! - All required headers are present, and no undeclared ones.
//!
//! Two kinds of answers have no operation: pages outside the interface ([`BESIDE`]), and refusals of unknown
//! paths and methods, which are problems.

mod answer;
mod closed;
mod document;
mod tests;
mod validator;

use std::sync::LazyLock;

use gramian::http::problem;
use serde_json::{Value, json};

pub use answer::{AnswerParts, decompressed};
use document::{Contract, Lookup, Operation, Response};
use validator::Validator;

/// Paths outside the interface, with everything below them: pages for people, and the documents themselves.
const BESIDE: [&str; 4] = ["/docs", "/openapi.json", "/openapi-3.0.json", "/page"];

/// Headers that any answer may have: those of HTTP, compression, CORS and browser policies. All others must
/// be declared. `gramian-cloud` is here because refusals repeat, for proxies, the cloud that a request named.
const OF_HTTP: [&str; 13] = [
    "cache-control",
    "gramian-cloud",
    "content-type",
    "content-length",
    "content-encoding",
    "transfer-encoding",
    "connection",
    "date",
    "vary",
    "x-content-type-options",
    "content-security-policy",
    "x-frame-options",
    "referrer-policy",
];

/// Panics if the document does not allow this answer.
pub fn check(method: &str, path: &str, answer: &AnswerParts) {
    static CONTRACT: LazyLock<Contract> = LazyLock::new(|| {
        let document = crate::support::document();
        Contract::new(&document)
    });
    let mismatches = CONTRACT.mismatches(method, path, answer);
    assert!(
        mismatches.is_empty(),
        "{method} {path} is answered against the document:\n- {}\n{:?}\n{:.2000}",
        mismatches.join("\n- "),
        answer.headers,
        String::from_utf8_lossy(&answer.bytes)
    );
}

impl Contract {
    /// Returns every deviation of an answer from the document. Empty if there is none.
    pub fn mismatches(&self, method: &str, path: &str, answer: &AnswerParts) -> Vec<String> {
        let mut found = match self.find(method, path) {
            Lookup::By(operation) => of_operation(operation, method, answer),
            Lookup::OtherMethods(allowed) => of_undeclared_method(&allowed, method, answer),
            Lookup::Nowhere if is_beside(path) => vec![],
            Lookup::Nowhere => expect_status(404, "the document has no such path", answer),
        };
        if answer.status >= 400 {
            found.extend(self.of_problem(method, answer));
        }
        if answer.header("x-request-id").is_empty() {
            found.push("no x-request-id".to_owned());
        }
        found
    }

    /// Checks a problem: one form for all of them, and the status that belongs to its type.
    fn of_problem(&self, method: &str, answer: &AnswerParts) -> Vec<String> {
        if method == "HEAD" {
            return no_body(answer);
        }
        let Some(problem) = answer.json().filter(|_| answer.media_type() == "application/problem+json")
        else {
            return vec![format!("{} is no problem document", answer.status)];
        };
        let mut found = violations("problem", &self.problem, &problem);
        let slug = problem["type"].as_str().and_then(|kind| problem::named(kind.strip_prefix("/problems/")?));
        if slug.is_none_or(|slug| slug.status().as_u16() != answer.status) {
            found.push(format!("type {} has another status than {}", problem["type"], answer.status));
        }
        if problem["status"] != json!(answer.status) || problem["instance"] != answer.header("x-request-id") {
            found.push("status and instance of the problem are not those of the answer".to_owned());
        }
        found
    }
}

fn is_beside(path: &str) -> bool {
    BESIDE
        .iter()
        .any(|known| path.strip_prefix(known).is_some_and(|rest| rest.is_empty() || rest.starts_with('/')))
}

fn of_operation(operation: &Operation, method: &str, answer: &AnswerParts) -> Vec<String> {
    let Some(response) = operation.get(&answer.status.to_string()) else {
        let declared: Vec<_> = operation.keys().map(String::as_str).collect();
        return vec![format!("status {}, declared are {}", answer.status, declared.join(", "))];
    };
    let mut found = of_headers(response, answer);
    if method == "HEAD" {
        found.extend(no_body(answer));
        return found;
    }
    found.extend(of_body(response, answer));
    if answer.status >= 400 {
        found.extend(of_problem_type(response, answer));
    }
    found
}

/// Checks that the operation declares the type of a problem for its status.
fn of_problem_type(response: &Response, answer: &AnswerParts) -> Option<String> {
    let problem = answer.json()?;
    let kind = problem["type"].as_str().unwrap_or_default();
    let is_declared = kind.strip_prefix("/problems/").is_some_and(|slug| response.problems.contains(slug));
    (!is_declared).then(|| format!("the type {kind} is not declared for {}", answer.status))
}

/// Checks the answer to an undeclared method: a CORS preflight where origins are configured, else 405 with
/// `Allow`.
fn of_undeclared_method(allowed: &[String], method: &str, answer: &AnswerParts) -> Vec<String> {
    if method == "OPTIONS" && !answer.header("access-control-allow-methods").is_empty() {
        return no_body(answer);
    }
    let mut found = expect_status(405, "the document has no such method", answer);
    let mut listed: Vec<_> = answer.header("allow").split(',').map(|name| name.trim().to_owned()).collect();
    listed.sort();
    if listed != allowed {
        found.push(format!("Allow: {listed:?}, declared are {allowed:?}"));
    }
    found
}

fn expect_status(expected: u16, why: &str, answer: &AnswerParts) -> Vec<String> {
    if answer.status == expected {
        return vec![];
    }
    vec![format!("status {} instead of {expected}: {why}", answer.status)]
}

fn of_headers(response: &Response, answer: &AnswerParts) -> Vec<String> {
    let mut found = Vec::new();
    for (name, header) in &response.headers {
        match answer.headers.get(name) {
            None if header.is_required => found.push(format!("no {name}")),
            None => {}
            Some(value) => {
                let value = value.to_str().unwrap();
                // Values are text. Those declared as numbers, such as Retry-After, are parsed as numbers.
                let text = json!(value);
                let number = serde_json::from_str(value).ok().filter(Value::is_number);
                let value = number.filter(|_| !header.schema.errors(&text).is_empty()).unwrap_or(text);
                found.extend(violations(name, &header.schema, &value));
            }
        }
    }
    for name in answer.headers.keys().map(reqwest::header::HeaderName::as_str) {
        let is_expected = response.headers.contains_key(name) || OF_HTTP.contains(&name);
        if !is_expected && !name.starts_with("access-control-") {
            found.push(format!("{name} is not declared"));
        }
    }
    found
}

fn of_body(response: &Response, answer: &AnswerParts) -> Vec<String> {
    if response.content.is_empty() {
        return no_body(answer);
    }
    let media_type = answer.media_type();
    let Some(schema) = response.content.get(&media_type) else {
        let declared: Vec<_> = response.content.keys().map(String::as_str).collect();
        return vec![format!("Content-Type {media_type:?}, declared are {}", declared.join(", "))];
    };
    match media_type.as_str() {
        "application/x-safetensors" => {
            let tensors = safetensors::SafeTensors::deserialize(&answer.bytes);
            tensors.err().map(|error| format!("no safetensors: {error}")).into_iter().collect()
        }
        json if json.ends_with("json") => match answer.json() {
            Some(body) => violations("body", schema, &body),
            None => vec!["the body is no JSON".to_owned()],
        },
        _ => vec![],
    }
}

fn no_body(answer: &AnswerParts) -> Vec<String> {
    if answer.bytes.is_empty() { vec![] } else { vec!["a body, and none is declared".to_owned()] }
}

/// Returns the violations of a schema, by JSON pointer. At most five, since one mistake may repeat in every
/// entry of an array.
fn violations(name: &str, schema: &Validator, value: &Value) -> Vec<String> {
    schema.errors(value).into_iter().take(5).map(|error| format!("{name}{error:.500}")).collect()
}
