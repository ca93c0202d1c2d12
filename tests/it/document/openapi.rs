//! The OpenAPI documents: the committed one, and that of version 3.0, which is derived from it.

use std::path::Path;

use serde_json::Value;

use crate::support::{document, overwrites};

#[test]
fn the_committed_document_is_the_generated_one() {
    let generated = gramian::http::openapi_json();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("openapi/openapi.json");
    if overwrites() {
        std::fs::write(&path, &generated).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == generated,
        "openapi/openapi.json is stale; run `EXPECTORATE=overwrite cargo test --test it openapi` twice: once for examples, once for the document"
    );
}

fn documents() -> [(&'static str, String); 2] {
    [("3.1", gramian::http::openapi_json()), ("3.0", gramian::http::openapi_3_0_json())]
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
    for (name, document) in documents() {
        let document: Value = serde_json::from_str(&document).unwrap();
        let mut n_references = 0;
        visit(&document, "", &mut |pointer, value| {
            if let Some(target) = value.get("$ref").and_then(Value::as_str) {
                n_references += 1;
                let target = target.strip_prefix('#').unwrap();
                assert!(document.pointer(target).is_some(), "{name}: {pointer} refers to {target}");
            }
        });
        assert!(n_references > 50, "{name}");
    }
}

#[test]
fn everything_is_described() {
    let document = document();
    for (path, item) in document["paths"].as_object().unwrap() {
        for (method, operation) in item.as_object().unwrap() {
            for text in ["operationId", "summary", "description"] {
                assert!(operation[text].is_string(), "{method} {path} has no {text}");
            }
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

/// Generators that support one media type of a body take the first.
#[test]
fn json_is_the_first_media_type() {
    let mut n_choices = 0;
    visit(&document(), "", &mut |pointer, value| {
        let Some(content) = value.get("content").and_then(Value::as_object) else { return };
        let names: Vec<_> = content.keys().collect();
        n_choices += usize::from(names.len() > 1);
        assert!(names.len() == 1 || names[0] == "application/json", "{pointer}: {names:?}");
    });
    assert!(n_choices > 20, "{n_choices}");
}

#[test]
fn requests_refuse_unknown_fields() {
    let document = document();
    for (name, schema) in document["components"]["schemas"].as_object().unwrap() {
        // An estimate has the members of the request that it is about, and that request refuses the rest.
        let is_open = name == "EstimateRequest";
        if !is_open && name.ends_with("Request")
            || ["CloudInput", "Kernel", "Surface"].contains(&name.as_str())
        {
            assert_eq!(schema["additionalProperties"], Value::Bool(false), "{name}");
        }
    }
}
