//! The document for generators that only support `OpenAPI` 3.0: the same operations and types, but JSON only.
//!
//! The Rust client derives its document by this file too (sdk/rust/build.rs), so it needs serde_json alone.

use serde_json::{Map, Value, json};

type Object = Map<String, Value>;

const WHAT_IS_DIFFERENT: &str = " This document is for tools that stop at OpenAPI 3.0: it has bodies in JSON only, no links and \
                                 no pages, and declares problem documents, which are sent as application/problem+json, as \
                                 application/json.";

/// Translates a document of version 3.1 to 3.0.3.
///
/// Features that 3.0 lacks are expressed in its terms: nullable types, exclusive bounds, descriptions beside
/// references, licences. All bodies are `application/json`, including problem documents, since generators
/// know no other type. Operations that only answer with HTML pages are left out, and so are links, which
/// generators ignore.
pub fn derive(mut document: Value) -> Value {
    document["openapi"] = json!("3.0.3");
    if let Some(license) = document.pointer_mut("/info/license").and_then(Value::as_object_mut) {
        license.shift_remove("identifier");
    }
    if let Some(paths) = document["paths"].as_object_mut() {
        for item in paths.values_mut().filter_map(Value::as_object_mut) {
            item.retain(|_, operation| !answers_pages(operation));
        }
        paths.retain(|_, item| item.as_object().is_some_and(|item| !item.is_empty()));
    }
    if let Some(Value::String(description)) = document.pointer_mut("/info/description") {
        description.push_str(WHAT_IS_DIFFERENT);
    }
    translate(&mut document);
    drop_unused_examples(&mut document);
    document
}

/// Drops the examples of operations that were left out.
fn drop_unused_examples(document: &mut Value) {
    let text = document["paths"].to_string();
    if let Some(examples) = document.pointer_mut("/components/examples").and_then(Value::as_object_mut) {
        examples.retain(|name, _| text.contains(&format!("\"#/components/examples/{name}\"")));
    }
}

/// Whether success has a body, but none in JSON.
fn answers_pages(operation: &Value) -> bool {
    let content = operation.pointer("/responses/200/content").and_then(Value::as_object);
    content.is_some_and(|content| !content.contains_key("application/json"))
}

/// Translates every object of the document, innermost first.
fn translate(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(translate),
        Value::Object(object) => {
            for (name, member) in object.iter_mut() {
                match (name.as_str(), member) {
                    // Examples are data. Any resemblance to a schema is accidental.
                    ("example" | "examples", _) => {}
                    // The keys of `properties` are member names, not keywords.
                    ("properties", Value::Object(properties)) => properties.values_mut().for_each(translate),
                    (_, member) => translate(member),
                }
            }
            if object.get("links").is_some_and(Value::is_object) {
                object.shift_remove("links");
            }
            keep_json(object);
            take_null_out_of_type(object);
            translate_bound(object, "exclusiveMinimum", "minimum");
            translate_bound(object, "exclusiveMaximum", "maximum");
            wrap_reference(object);
        }
        _ => {}
    }
}

/// Keeps only JSON, and declares problem documents as JSON.
fn keep_json(object: &mut Object) {
    let Some(content) = object.get_mut("content").and_then(Value::as_object_mut) else { return };
    if let Some(problem) = content.shift_remove("application/problem+json") {
        content.insert("application/json".to_owned(), problem);
    }
    content.retain(|media_type, _| media_type == "application/json");
}

/// Turns `type: [x, null]` into `type: x, nullable: true`.
fn take_null_out_of_type(object: &mut Object) {
    let Some(Value::Array(types)) = object.get("type") else { return };
    let mut kept: Vec<Value> = types.iter().filter(|kind| *kind != "null").cloned().collect();
    if kept.len() < types.len() {
        object.insert("nullable".to_owned(), json!(true));
    }
    if kept.len() == 1 {
        object.insert("type".to_owned(), kept.remove(0));
    }
}

/// Turns `exclusiveMinimum: x` into `minimum: x, exclusiveMinimum: true`.
fn translate_bound(object: &mut Object, exclusive: &str, inclusive: &str) {
    if object.get(exclusive).is_some_and(Value::is_number) {
        let bound = object.insert(exclusive.to_owned(), json!(true));
        object.insert(inclusive.to_owned(), bound.unwrap_or_default());
    }
}

/// Wraps a reference with siblings in an `allOf`, because a reference must stand alone in 3.0.
fn wrap_reference(object: &mut Object) {
    if object.len() > 1
        && object.get("$ref").is_some_and(Value::is_string)
        && let Some(reference) = object.shift_remove("$ref")
    {
        object.insert("allOf".to_owned(), json!([{"$ref": reference}]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_3_0_cannot_say_is_said_its_way() {
        let derived = |schema: Value| derive(json!({"schema": schema}))["schema"].clone();
        assert_eq!(derived(json!({"type": ["array", "null"]})), json!({"type": "array", "nullable": true}));
        assert_eq!(
            derived(json!({"exclusiveMinimum": 0.0})),
            json!({"minimum": 0.0, "exclusiveMinimum": true})
        );
        let reference = "#/components/schemas/A";
        let described = json!({"$ref": reference, "description": "An A."});
        assert_eq!(derived(described), json!({"description": "An A.", "allOf": [{"$ref": reference}]}));
        assert_eq!(derived(json!({"$ref": reference})), json!({"$ref": reference}));
        let named_as_keywords =
            json!({"properties": {"links": {"type": "object"}, "content": {"type": "object"}}});
        assert_eq!(derived(named_as_keywords.clone()), named_as_keywords);
        let example = json!({"example": {"type": ["x", "null"]}});
        assert_eq!(derived(example.clone()), example);
    }

    #[test]
    fn bodies_are_json_and_pages_are_left_out() {
        let answers = |media_type: &str| {
            json!({"responses": {"200": {"content": {media_type: {}, "application/x-npy": {}},
                                        "links": {"next": {}}},
                                 "404": {"content": {"application/problem+json": {}}}}})
        };
        let paths = json!({"/a": {"get": answers("application/json"), "post": answers("text/html")}, "/b": {"get": answers("text/html")}});
        let derived =
            derive(json!({"paths": paths, "info": {"license": {"name": "MIT", "identifier": "MIT"}}}));
        let json = json!({"content": {"application/json": {}}});
        assert_eq!(derived["paths"], json!({"/a": {"get": {"responses": {"200": json, "404": json}}}}));
        assert_eq!(derived["info"], json!({"license": {"name": "MIT"}}));
        assert_eq!(derived["openapi"], "3.0.3");
    }
}
