//! Rules for schemas, each for requests and for answers.

use std::collections::BTreeSet;

use serde_json::Value;

use super::{Comparison, below, members};

/// Direction of a value. The service must still read what clients write, and clients must still understand
/// the service.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Direction {
    Request,
    Answer,
}

/// Keywords that do not restrict values.
const ANNOTATIONS: [&str; 8] =
    ["description", "title", "example", "examples", "deprecated", "externalDocs", "$comment", "$ref"];

/// Keywords with their own rule.
const RULED: [&str; 8] = ["type", "enum", "properties", "required", "items", "allOf", "anyOf", "oneOf"];

/// Lower bounds, where a larger value is stricter, and upper bounds, where a smaller one is.
const LOWER_BOUNDS: [&str; 5] = ["minimum", "exclusiveMinimum", "minItems", "minLength", "minProperties"];
const UPPER_BOUNDS: [&str; 5] = ["maximum", "exclusiveMaximum", "maxItems", "maxLength", "maxProperties"];

impl Comparison<'_> {
    pub fn compare_schema(&mut self, direction: Direction, pointer: &str, old: &Value, new: &Value) {
        let are_references = old.get("$ref").is_some() && new.get("$ref").is_some();
        if are_references {
            // Keywords may stand beside the references.
            self.compare_keywords(direction, pointer, old, new);
        }
        let (old_at, old) = followed(self.released, pointer, old);
        let (new_at, new) = followed(self.current, pointer, new);
        // Every cycle passes through references in both documents, so recursion ends here. A schema written
        // inline in one of them is finite.
        if are_references && !self.compared.insert((direction, old_at.clone(), new_at)) {
            return;
        }
        self.compare_keywords(direction, &old_at, old, new);
    }

    fn compare_keywords(&mut self, direction: Direction, pointer: &str, old: &Value, new: &Value) {
        self.compare_types(direction, pointer, old, new);
        self.compare_enumerations(direction, pointer, old, new);
        self.compare_members(direction, pointer, old, new);
        self.compare_required(direction, pointer, old, new);
        self.compare_parts(direction, pointer, old, new);
        self.compare_bounds(direction, pointer, old, new);
        self.compare_other_keywords(direction, pointer, old, new);
        self.compare_items(direction, pointer, old, new);
    }

    fn compare_types(&mut self, direction: Direction, pointer: &str, old: &Value, new: &Value) {
        let (old, new) = (types(old), types(new));
        let (written, read) = direction.written_and_read(&old, &new);
        let is_read = |kind: &&String| {
            read.is_empty() || read.contains(*kind) || *kind == "integer" && read.contains("number")
        };
        if !written.iter().all(|kind| is_read(&kind)) || written.is_empty() && !read.is_empty() {
            self.report(&below(pointer, "type"), format!("{old:?} became {new:?} in {}", direction.place()));
        }
    }

    fn compare_enumerations(&mut self, direction: Direction, pointer: &str, old: &Value, new: &Value) {
        let (written, read) = direction.written_and_read(&old["enum"], &new["enum"]);
        let Some(read) = read.as_array() else { return };
        let pointer = below(pointer, "enum");
        let Some(written) = written.as_array() else {
            self.report(&pointer, format!("the enumeration is another in {}", direction.place()));
            return;
        };
        for value in written.iter().filter(|value| !read.contains(value)) {
            let verb = if direction == Direction::Request { "removed from" } else { "added to" };
            self.report(&pointer, format!("{value} was {verb} {}", direction.place()));
        }
    }

    /// Compares the members of objects. New members are compatible: requests need not have them, and clients
    /// ignore them.
    fn compare_members(&mut self, direction: Direction, pointer: &str, old: &Value, new: &Value) {
        for (name, old) in members(&old["properties"]) {
            let pointer = below(&below(pointer, "properties"), name);
            match new["properties"].get(name) {
                Some(new) => self.compare_schema(direction, &pointer, old, new),
                None => self.report(&pointer, format!("the member was removed from {}", direction.place())),
            }
        }
    }

    fn compare_required(&mut self, direction: Direction, pointer: &str, old: &Value, new: &Value) {
        let names = |schema: &Value| -> BTreeSet<String> {
            schema["required"]
                .as_array()
                .into_iter()
                .flatten()
                .map(|name| name.as_str().unwrap().to_owned())
                .collect()
        };
        let (old, new) = (names(old), names(new));
        let (lost, what) = match direction {
            Direction::Request => (&new - &old, "the member became required in requests"),
            Direction::Answer => (&old - &new, "the member became optional in answers"),
        };
        for name in lost {
            self.report(&below(&below(pointer, "properties"), &name), what);
        }
    }

    /// Compares compositions, which must keep their parts in order.
    fn compare_parts(&mut self, direction: Direction, pointer: &str, old: &Value, new: &Value) {
        for keyword in ["allOf", "anyOf", "oneOf"] {
            let pointer = below(pointer, keyword);
            let parts = |schema: &Value| schema[keyword].as_array().cloned().unwrap_or_default();
            let (old, new) = (parts(old), parts(new));
            if old.len() != new.len() {
                self.report(&pointer, format!("{} parts became {}", old.len(), new.len()));
            }
            for (index, (old, new)) in old.iter().zip(&new).enumerate() {
                self.compare_schema(direction, &below(&pointer, &index.to_string()), old, new);
            }
        }
    }

    /// Compares bounds. Bounds of requests may be loosened, bounds of answers tightened.
    fn compare_bounds(&mut self, direction: Direction, pointer: &str, old: &Value, new: &Value) {
        for (keywords, sign) in [(LOWER_BOUNDS, 1.0), (UPPER_BOUNDS, -1.0)] {
            for keyword in keywords {
                let strictness =
                    |schema: &Value| schema[keyword].as_f64().map_or(f64::NEG_INFINITY, |x| sign * x);
                let (written, read) = direction.written_and_read(old, new);
                if strictness(written) < strictness(read) {
                    let what = format!("{} became {} in {}", old[keyword], new[keyword], direction.place());
                    self.report(&below(pointer, keyword), what);
                }
            }
        }
    }

    /// Compares all other keywords. Each must stay as it is, unless it is a restriction that requests lose or
    /// answers gain.
    fn compare_other_keywords(&mut self, direction: Direction, pointer: &str, old: &Value, new: &Value) {
        let is_known = |name: &str| {
            [&ANNOTATIONS[..], &RULED, &LOWER_BOUNDS, &UPPER_BOUNDS].concat().contains(&name)
                || name.starts_with("x-")
        };
        let names: BTreeSet<_> = members(old).chain(members(new)).map(|(name, _)| name).collect();
        for name in names.into_iter().filter(|name| !is_known(name)) {
            let (written, read) = direction.written_and_read(old.get(name), new.get(name));
            // A default is no restriction. It defines what the absence of a member means.
            let is_lifted = read.is_none() && name != "default";
            if written != read && !is_lifted {
                let show = |value: Option<&Value>| value.map_or("nothing".to_owned(), Value::to_string);
                let what = format!("{} became {}", show(old.get(name)), show(new.get(name)));
                self.report(&below(pointer, name), format!("{what} in {}", direction.place()));
            }
        }
    }

    /// Compares the schemas of items. A missing schema allows any item.
    fn compare_items(&mut self, direction: Direction, pointer: &str, old: &Value, new: &Value) {
        let (old, new) = (old.get("items"), new.get("items"));
        if old.is_none() && new.is_none() {
            return;
        }
        let anything = Value::Bool(true);
        let (old, new) = (old.unwrap_or(&anything), new.unwrap_or(&anything));
        self.compare_schema(direction, &below(pointer, "items"), old, new);
    }
}

impl Direction {
    /// Orders two values as (written, read). Everything written must be allowed by the reader: clients write
    /// requests as released, and the service writes answers as now.
    fn written_and_read<T>(self, released: T, current: T) -> (T, T) {
        match self {
            Self::Request => (released, current),
            Self::Answer => (current, released),
        }
    }

    fn place(self) -> &'static str {
        match self {
            Self::Request => "requests",
            Self::Answer => "answers",
        }
    }
}

/// Returns the types that a schema admits. Empty if it admits any.
fn types(schema: &Value) -> BTreeSet<String> {
    let one_or_many = match &schema["type"] {
        Value::Array(many) => many.as_slice(),
        one => std::slice::from_ref(one),
    };
    one_or_many.iter().filter_map(Value::as_str).map(str::to_owned).collect()
}

/// Returns the target of a reference, or the value itself, with its pointer.
pub fn followed<'a>(document: &'a Value, pointer: &str, value: &'a Value) -> (String, &'a Value) {
    let Some(target) = value["$ref"].as_str().and_then(|target| target.strip_prefix('#')) else {
        return (pointer.to_owned(), value);
    };
    (target.to_owned(), document.pointer(target).unwrap_or(&Value::Null))
}
