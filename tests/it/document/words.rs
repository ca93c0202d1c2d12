//! Rules of the names in the document: those of `include`, and those of standard deviations.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

use crate::support::document;

/// Returns the schema that a reference points to, or the schema itself.
fn resolved<'a>(document: &'a Value, schema: &'a Value) -> &'a Value {
    let target = schema["$ref"].as_str().and_then(|target| target.strip_prefix('#'));
    target.map_or(schema, |target| document.pointer(target).unwrap())
}

/// The names of the members of a schema.
fn members(schema: &Value) -> Vec<&str> {
    schema["properties"].as_object().into_iter().flatten().map(|(name, _)| name.as_str()).collect()
}

/// Whether members have one of this name, for one or for many. Curvatures are of several kinds.
fn have(members: &[&str], name: &str) -> bool {
    let is_it = |member: &&&str| **member == name || member.strip_suffix('s') == Some(name);
    let is_kind = |member: &&&str| name == "curvatures" && member.ends_with("_curvatures");
    members.iter().find(is_it).or(members.iter().find(is_kind)).is_some()
}

#[test]
fn a_word_of_include_is_the_member_that_it_adds() {
    let (document, mut n_words) = (document(), 0);
    for (path, item) in document["paths"].as_object().unwrap() {
        let body = &item["post"]["requestBody"]["content"]["application/json"]["schema"];
        let answer = &item["post"]["responses"]["200"]["content"]["application/json"]["schema"];
        let [request, answer] = [body, answer].map(|schema| resolved(&document, schema));
        let words = &resolved(&document, &request["properties"]["include"]["items"])["enum"];
        for word in words.as_array().into_iter().flatten().filter_map(Value::as_str) {
            n_words += 1;
            let is_member = match word {
                "std" => members(answer).iter().any(|member| member.ends_with("_std")),
                _ => have(&members(answer), word),
            };
            assert!(is_member, "{path}: {word}");
        }
    }
    assert!(n_words > 20, "{n_words}");
}

#[test]
fn a_standard_deviation_stands_beside_what_it_is_of() {
    let (document, mut n_found) = (document(), 0);
    for (schema, of) in document["components"]["schemas"].as_object().unwrap() {
        let members = members(of);
        for name in members.iter().filter_map(|member| member.strip_suffix("_std")) {
            n_found += 1;
            // The positions of a mesh are its vertices.
            let is_beside = have(&members, name) || (name == "position" && members.contains(&"vertices"));
            assert!(is_beside, "{schema}: {name}_std");
        }
    }
    assert!(n_found > 15, "{n_found}");
}

/// Tables of the documentation that list what exists: the page, the head of the first column, and the schema.
const TABLES: [(&str, &str, &str); 4] = [
    ("docs/numerics.md", "warning", "WarningCode"),
    ("docs/numerics.md", "reason in `flags`", "FlagReason"),
    ("docs/numerics.md", "family", "KernelFamily"),
    ("docs/trust.md", "solver", "SolverUsed"),
];

/// The rows of a table of a page: the name in the first column, and the text of the others.
fn table(page: &str, head: &str) -> Vec<(String, String)> {
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(page)).unwrap();
    let rows = text.lines().skip_while(|line| !line.starts_with(&format!("| {head} |"))).skip(2);
    let parts = rows.map_while(|row| row.strip_prefix("| `")?.split_once('`'));
    parts.map(|(name, rest)| (name.to_owned(), rest.to_owned())).collect()
}

#[test]
fn tables_list_what_exists() {
    let document = document();
    for (page, head, schema) in TABLES {
        let listed: BTreeSet<String> = table(page, head).into_iter().map(|(name, _)| name).collect();
        let words = document["components"]["schemas"][schema]["enum"].as_array().unwrap();
        let existing: BTreeSet<String> = words.iter().filter_map(Value::as_str).map(str::to_owned).collect();
        assert_eq!(listed, existing, "{page}, {head}");
    }
}

/// The media types of the contents that a pointer leads to, over all operations. Pages are not answers of
/// an operation, events and problems not its formats.
fn media_types(document: &Value, pointer: &str) -> BTreeSet<String> {
    let operations =
        document["paths"].as_object().unwrap().values().flat_map(|item| item.as_object().unwrap());
    let contents = operations.filter_map(|(_, operation)| operation.pointer(pointer)?.as_object());
    let names = contents.flat_map(|content| content.keys().cloned());
    names.filter(|name| name.starts_with("application/") || name.starts_with("model/")).collect()
}

#[test]
fn the_table_of_formats_lists_those_of_bodies_and_answers() {
    let (document, rows) = (document(), table("docs/api.md", "media type"));
    let listed: BTreeSet<String> = rows.iter().map(|(name, _)| name.clone()).collect();
    let is_read = |(_, rest): &&(String, String)| !rest.starts_with(" | none |");
    let of_bodies: BTreeSet<String> = rows.iter().filter(is_read).map(|(name, _)| name.clone()).collect();
    assert_eq!(of_bodies, media_types(&document, "/requestBody/content"));
    assert_eq!(listed, media_types(&document, "/responses/200/content"));
}
