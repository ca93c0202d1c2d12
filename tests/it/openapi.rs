//! The committed OpenAPI document.

use std::path::Path;

use gramian::http::openapi::EXAMPLES;
use serde_json::Value;

use crate::support::Server;

/// Set to `overwrite` to write the file instead of comparing with it.
const OVERWRITE_VARIABLE: &str = "EXPECTORATE";

#[test]
fn the_committed_document_is_the_generated_one() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("openapi/openapi.json");
    let generated = gramian::http::openapi_json();
    if std::env::var(OVERWRITE_VARIABLE).is_ok_and(|value| value == "overwrite") {
        std::fs::write(&path, &generated).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == generated,
        "openapi/openapi.json is stale; run `EXPECTORATE=overwrite cargo test --test it openapi` twice: once for examples, once for the document"
    );
}

fn document() -> Value {
    serde_json::from_str(&gramian::http::openapi_json()).unwrap()
}

fn visit(value: &Value, pointer: &str, see: &mut impl FnMut(&str, &Value)) {
    see(pointer, value);
    match value {
        Value::Object(members) => {
            for (name, member) in members {
                visit(member, &format!("{pointer}/{}", name.replace('~', "~0").replace('/', "~1")), see);
            }
        }
        Value::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                visit(item, &format!("{pointer}/{index}"), see);
            }
        }
        _ => {}
    }
}

#[test]
fn every_reference_resolves() {
    let document = document();
    let mut n_references = 0;
    visit(&document, "", &mut |pointer, value| {
        if let Some(target) = value.get("$ref").and_then(Value::as_str) {
            n_references += 1;
            let target = target.strip_prefix('#').unwrap();
            assert!(document.pointer(target).is_some(), "{pointer} refers to {target}");
        }
    });
    assert!(n_references > 50);
}

#[test]
fn everything_is_described() {
    let document = document();
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap() {
            assert!(
                operation["operationId"].is_string() && operation["summary"].is_string(),
                "{method} {path}"
            );
            for (status, response) in operation["responses"].as_object().unwrap() {
                let is_described = response["description"].as_str().is_some_and(|text| !text.is_empty());
                assert!(is_described, "{method} {path} {status}");
            }
        }
    }
    for (name, schema) in document["components"]["schemas"].as_object().unwrap() {
        assert!(schema["description"].is_string(), "schema {name} has no description");
        for (field, property) in schema["properties"].as_object().into_iter().flatten() {
            assert!(property["description"].is_string(), "{name}.{field} has no description");
        }
    }
}

#[test]
fn requests_refuse_unknown_fields() {
    let document = document();
    for (name, schema) in document["components"]["schemas"].as_object().unwrap() {
        if name.ends_with("Request") || ["CloudRef", "Kernel", "Geometry"].contains(&name.as_str()) {
            assert_eq!(schema["additionalProperties"], Value::Bool(false), "{name}");
        }
    }
}

/// Entries agree up to rounding of the largest number of an array; what depends on the moment is only there.
fn assert_like(name: &str, found: &Value, expected: &Value) {
    match (found, expected) {
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
            assert!((a - b).abs() <= 1e-9 * b.abs().max(1e-3), "{name}: {a} against {b}");
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{name}");
            a.iter().zip(b).for_each(|(a, b)| assert_like(name, a, b));
        }
        (Value::Object(a), Value::Object(b)) => {
            assert!(a.keys().eq(b.keys()), "{name}: {:?} against {:?}", a.keys(), b.keys());
            for (key, b) in b.iter().filter(|(key, _)| *key != "created_at" && *key != "relative_residual") {
                assert_like(&format!("{name}.{key}"), &a[key], b);
            }
        }
        _ => assert_eq!(found, expected, "{name}"),
    }
}

#[tokio::test]
async fn every_example_is_what_the_service_answers() {
    let server = Server::start().await;
    let document = document();
    let mut n_examples = 0;
    for (path, item) in document["paths"].as_object().unwrap() {
        let Some(operation) = item.get("post") else { continue };
        let id = operation["operationId"].as_str().unwrap();
        let (_, text) =
            EXAMPLES.iter().find(|(name, _)| *name == id).unwrap_or_else(|| panic!("no example of {id}"));
        let mut example: Value = serde_json::from_str(text).unwrap();
        let answer = server.post(path, &example["request"]).await;
        assert!(answer.status < 300, "{id}: {}", answer.text);
        if std::env::var(OVERWRITE_VARIABLE).is_ok_and(|value| value == "overwrite") {
            example["response"] = answer.json();
            // The only member that depends on the moment.
            if let Some(created_at) = example["response"].get_mut("created_at") {
                *created_at = Value::from("2026-01-01T00:00:00.000Z");
            }
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("openapi/examples/{id}.json"));
            std::fs::write(file, serde_json::to_string_pretty(&example).unwrap() + "\n").unwrap();
        } else {
            assert_like(id, &answer.json(), &example["response"]);
        }
        n_examples += 1;
    }
    assert_eq!(n_examples, EXAMPLES.len());
}
