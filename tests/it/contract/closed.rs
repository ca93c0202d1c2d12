//! Schemas that admit no member which they do not name.
//!
//! Answers may grow, so the document leaves their objects open: a client must pass over members that it does not know. But this
//! version answers what this version's document says, and a member that it does not name is a mistake in one of the two.

use serde_json::{Value, json};

/// Closes a schema that is the whole schema of a value, and all that are below it.
pub fn closed(schema: &mut Value) {
    close_parts(schema);
    let Some(members) = schema.as_object_mut() else { return };
    let has = |keys: &[&str]| keys.iter().any(|key| members.contains_key(*key));
    if has(&["properties", "$ref", "allOf", "anyOf", "oneOf"]) && !has(&["additionalProperties"]) {
        // Sees what all parts of a composition and the targets of references name.
        members.insert("unevaluatedProperties".to_owned(), json!(false));
    }
}

/// Closes what is below a schema. The schema itself may be a part of a composition, which knows some members only.
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
