//! Closed schemas, which admit only the members that they name.
//!
//! Answers may grow, so the document leaves their objects open, and clients must ignore members they do not
//! know. But this version answers according to its own document, so an unnamed member is a mistake in one of
//! the two.

use serde_json::{Value, json};

/// Closes a schema that describes a value alone, and all schemas below it.
pub fn closed(schema: &mut Value) {
    close_parts(schema);
    let Some(members) = schema.as_object_mut() else { return };
    let has = |keys: &[&str]| keys.iter().any(|key| members.contains_key(*key));
    if has(&["properties", "$ref", "allOf", "anyOf", "oneOf"]) && !has(&["additionalProperties"]) {
        // `unevaluatedProperties` takes into account all parts of compositions and the targets of references.
        members.insert("unevaluatedProperties".to_owned(), json!(false));
    }
}

/// Closes the schemas below a schema. Leaves the schema itself open, since as a part of a composition it may
/// name only some members.
pub fn close_parts(schema: &mut Value) {
    for key in ["items", "additionalProperties"] {
        schema.get_mut(key).into_iter().for_each(closed);
    }
    for property in schema.get_mut("properties").and_then(Value::as_object_mut).into_iter().flatten() {
        closed(property.1);
    }
    for key in ["allOf", "anyOf", "oneOf"] {
        schema.get_mut(key).and_then(Value::as_array_mut).into_iter().flatten().for_each(close_parts);
    }
}
