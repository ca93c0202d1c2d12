//! Backward compatibility: today's OpenAPI document against the documents in openapi/released.
//!
//! A change is breaking if it forces a change in a client that follows the released document, or in code
//! generated from it. Requests and answers are mirror images. The values allowed in a request must not
//! shrink. Those allowed in an answer must not grow, except by new members of objects, which clients ignore.
//! A changed keyword that the schema rules do not know counts as breaking, so that newly used keywords are
//! noticed here.
//!
//! The rules are our own, and they read OpenAPI 3.1 as it is. The crate `drift` 0.2.0 was tried on the
//! document in its OpenAPI 3.0 form, with the mutations of `tests.rs`. It failed for these reasons:
//!
//! - It reports changes of members, required members, enumerations and bounds all as "unhandled", in requests
//!   and in answers. A member added to an answer looks like one removed.
//! - It misses changes of operation ids, headers and values that become null.
//! - It panics when a media type is added or removed.

mod operations;
mod schemas;
mod tests;

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::{Map, Value};

const REMEDY: &str = "Clients depend on these. Either do not change them, or serve the changed operation under a new version \
                      of its path beside the old one (docs/api.md, Versions).";

/// A breaking change: its pointer in the released document, and a description.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Change {
    pointer: String,
    what: String,
}

/// A comparison of two documents, with the changes found so far.
struct Comparison<'a> {
    released: &'a Value,
    current: &'a Value,
    changes: BTreeSet<Change>,
    /// Pairs of references already compared, with their direction. Stops recursion, since references may be
    /// cyclic.
    compared: BTreeSet<(schemas::Direction, String, String)>,
}

/// Returns every change that breaks clients of `released` when `current` is served.
fn breaking_changes(released: &Value, current: &Value) -> BTreeSet<Change> {
    let mut comparison =
        Comparison { released, current, changes: BTreeSet::new(), compared: BTreeSet::new() };
    comparison.compare_paths();
    comparison.compare_component_names();
    comparison.changes
}

impl Comparison<'_> {
    fn report(&mut self, pointer: &str, what: impl Into<String>) {
        self.changes.insert(Change { pointer: pointer.to_owned(), what: what.into() });
    }
}

/// Iterates over the members of an object. Empty for any other value.
fn members(value: &Value) -> impl Iterator<Item = (&String, &Value)> {
    value.as_object().into_iter().flat_map(Map::iter)
}

/// Returns `pointer` extended by one step, escaped as in RFC 6901.
fn below(pointer: &str, name: &str) -> String {
    format!("{pointer}/{}", name.replace('~', "~0").replace('/', "~1"))
}

#[test]
fn what_was_released_is_still_served() {
    let current = crate::support::document();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("openapi/released");
    let mut n_released = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let released: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
        let changes = breaking_changes(&released, &current);
        let list: Vec<_> =
            changes.iter().map(|change| format!("{}: {}", change.pointer, change.what)).collect();
        assert!(list.is_empty(), "breaking since {}:\n- {}\n{REMEDY}", path.display(), list.join("\n- "));
        n_released += 1;
    }
    assert!(n_released > 0);
}
