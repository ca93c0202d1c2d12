//! Tests of the documentation:
//!
//! - The examples of docs/api.md are those of the OpenAPI document, and its tables are complete.
//! - The settings in docs/operations.md are those of the process.
//! - The generators in sdk/README.md are those that are tested, and every operation is sized.
//! - Links lead somewhere.
//! - The README is short.
//!
//! A comment before each JSON block names a file, a pointer into it, and members left out:
//! `<!-- openapi/examples/compute_normals.json /response without diagnostics -->`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::Args;
use gramian::config::Config;
use gramian::http::problem;
use serde_json::Value;

use crate::support::overwrites;

const PAGE: &str = "docs/api.md";
/// Maximum columns in a line of an example.
const WIDTH: usize = 125;

fn at_root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn page() -> String {
    std::fs::read_to_string(at_root(PAGE)).unwrap()
}

/// A block of JSON, by the indices of its first line and of its closing fence.
struct Block {
    begin: usize,
    end: usize,
    /// The value that the block must show, according to the comment before it.
    expected: Value,
}

fn blocks(lines: &[&str]) -> Vec<Block> {
    let fences = (0..lines.len()).filter(|&index| lines[index] == "```json");
    let block = |fence: usize| {
        let end = fence + 1 + lines[fence + 1..].iter().position(|line| *line == "```").unwrap();
        Block { begin: fence + 1, end, expected: marked(lines[fence - 1], fence + 1) }
    };
    fences.map(block).collect()
}

/// Returns the value to which the comment before a block refers.
fn marked(line: &str, number: usize) -> Value {
    let marker = line.strip_prefix("<!-- ").and_then(|rest| rest.strip_suffix(" -->"));
    let marker =
        marker.unwrap_or_else(|| panic!("{PAGE}:{number}: a block of JSON without its source: {line}"));
    let (source, left_out) = marker.split_once(" without ").unwrap_or((marker, ""));
    let (file, pointer) = source.split_once(' ').unwrap_or((source, ""));
    let text = std::fs::read_to_string(at_root(file)).unwrap_or_else(|error| panic!("{file}: {error}"));
    let whole: Value = serde_json::from_str(&text).unwrap();
    let mut part = whole.pointer(pointer).unwrap_or_else(|| panic!("no {pointer} in {file}")).clone();
    for name in left_out.split(", ").filter(|name| !name.is_empty()) {
        let removed = part.as_object_mut().and_then(|members| members.shift_remove(name));
        assert!(removed.is_some(), "{PAGE}:{number}: {file} has no {name} to leave out");
    }
    part
}

#[test]
fn examples_are_those_of_the_document() {
    let page = page();
    let lines: Vec<_> = page.lines().collect();
    let blocks = blocks(&lines);
    assert!(blocks.len() >= 10);
    if overwrites() {
        std::fs::write(at_root(PAGE), rewritten(&lines, &blocks)).unwrap();
        return;
    }
    for block in &blocks {
        let text = lines[block.begin..block.end].join("\n");
        let shown: Value =
            serde_json::from_str(&text).unwrap_or_else(|error| panic!("{PAGE}:{}: {error}", block.begin));
        assert_eq!(
            shown, block.expected,
            "{PAGE}:{} is stale; run `EXPECTORATE=overwrite cargo test --test it docs`",
            block.begin
        );
    }
}

fn rewritten(lines: &[&str], blocks: &[Block]) -> String {
    let (mut text, mut done) = (String::new(), 0);
    for block in blocks {
        text += &(lines[done..block.begin].join("\n") + "\n");
        text += &(laid_out(&block.expected, 0, 0) + "\n");
        done = block.end;
    }
    text + &lines[done..].join("\n") + "\n"
}

/// Formats JSON with each value on one line if it fits, else with one entry a line. `column` is where the
/// value begins.
fn laid_out(value: &Value, indent: usize, column: usize) -> String {
    let flat = on_one_line(value);
    if column + flat.chars().count() < WIDTH {
        return flat;
    }
    let inner = indent + 2;
    let (open, lines, close) = match value {
        Value::Array(items) => ('[', filled(items, inner), ']'),
        Value::Object(members) => {
            let member = |(name, value): (&String, &Value)| {
                let name = format!("\"{name}\": ");
                format!("{name}{}", laid_out(value, inner, inner + name.len()))
            };
            ('{', members.iter().map(member).collect(), '}')
        }
        _ => return flat,
    };
    let (outer, inner) = (" ".repeat(indent), " ".repeat(inner));
    format!("{open}\n{inner}{}\n{outer}{close}", lines.join(&format!(",\n{inner}")))
}

/// Formats the items of an array, with as many on a line as fit.
fn filled(items: &[Value], indent: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for item in items.iter().map(|item| laid_out(item, indent, indent)) {
        match lines.last_mut() {
            Some(line) if indent + line.len() + item.len() + 3 < WIDTH => *line += &format!(", {item}"),
            _ => lines.push(item),
        }
    }
    lines
}

fn on_one_line(value: &Value) -> String {
    match value {
        Value::Array(items) => format!("[{}]", items.iter().map(on_one_line).collect::<Vec<_>>().join(", ")),
        Value::Object(members) => {
            let member = |(name, value): (&String, &Value)| format!("\"{name}\": {}", on_one_line(value));
            format!("{{{}}}", members.iter().map(member).collect::<Vec<_>>().join(", "))
        }
        other => other.to_string(),
    }
}

#[test]
fn every_problem_is_in_the_table() {
    let page = page();
    let section = page.split("\n## ").find(|section| section.starts_with("Problems")).unwrap();
    let rows = section.lines().filter(|line| line.starts_with("| `"));
    let cells = rows.map(|row| row.trim_matches('|').split(" | ").map(str::trim).collect::<Vec<_>>());
    let listed: Vec<_> = cells
        .map(|cells| {
            assert!(cells.len() == 3 && !cells[2].is_empty(), "{cells:?}");
            (cells[0].trim_matches('`').to_owned(), cells[1].parse::<u16>().unwrap())
        })
        .collect();
    let expected: Vec<_> =
        problem::all().iter().map(|slug| (slug.as_str().to_owned(), slug.status().as_u16())).collect();
    assert_eq!(listed, expected);
}

#[test]
fn every_operation_is_in_the_overview() {
    let document = crate::support::document();
    let page = page();
    let overview: Vec<_> = page.lines().filter(|line| line.starts_with("| `")).collect();
    for (path, item) in document["paths"].as_object().unwrap() {
        for method in item.as_object().unwrap().keys() {
            let method = method.to_ascii_uppercase();
            let is_in = |row: &&&str| row.contains(&format!("{path}`")) && row.contains(&method);
            assert!(overview.iter().find(is_in).is_some(), "{method} {path} is not in the overview");
        }
    }
}

#[test]
fn every_setting_is_in_the_table() {
    let page = std::fs::read_to_string(at_root("docs/operations.md")).unwrap();
    let rows = page.lines().filter(|line| line.starts_with("| `GRAMIAN_"));
    let listed: Vec<_> = rows
        .map(|row| {
            let cells: Vec<_> =
                row.trim_matches('|').split('|').map(|cell| cell.trim().replace('`', "")).collect();
            assert!(cells.len() == 5 && !cells[4].is_empty(), "{cells:?}");
            // "4294967296 (4 GiB)" is 4294967296.
            let number = cells[3].split(" (").next().unwrap();
            (cells[0].clone(), cells[1].clone(), number.to_owned())
        })
        .collect();
    let command = Config::augment_args(clap::Command::new("gramian"));
    let settings = command.get_arguments().filter_map(|setting| {
        let default = setting.get_default_values().first().map(|value| value.to_str().unwrap().to_owned());
        Some((setting.get_env()?.to_str()?.to_owned(), format!("--{}", setting.get_long()?), default))
    });
    let expected: Vec<_> = settings
        .zip(&listed)
        // Settings without a default describe their behaviour in words.
        .map(|((variable, flag, default), (.., words))| {
            (variable, flag, default.unwrap_or_else(|| words.clone()))
        })
        .collect();
    assert_eq!(listed, expected);
    assert_eq!(listed.len(), command.get_arguments().filter(|setting| setting.get_env().is_some()).count());
}

/// The table of generators in sdk/README.md has the clients that `sdk/test` tests, in its order.
#[test]
fn every_generator_is_in_the_table() {
    let page = std::fs::read_to_string(at_root("sdk/README.md")).unwrap();
    let rows = page.lines().filter(|line| line.contains(" | 3.1 | ") || line.contains(" | 3.0"));
    let listed: Vec<_> = rows
        .map(|row| {
            let cells: Vec<_> = row.trim_matches('|').split(" | ").map(str::trim).collect();
            assert!(cells.len() == 5 && cells.iter().all(|cell| !cell.is_empty()), "{cells:?}");
            cells[3].strip_prefix('[').and_then(|link| link.split(']').next()).unwrap().to_owned()
        })
        .collect();
    let script = std::fs::read_to_string(at_root("sdk/test")).unwrap();
    let lists = ["quick=(", "long=("].map(|name| {
        let list = script.split(name).nth(1).and_then(|rest| rest.split(')').next()).unwrap();
        list.split_whitespace().map(str::to_owned).collect::<Vec<_>>()
    });
    assert_eq!(listed, lists.concat());
    assert_eq!(listed.into_iter().collect::<BTreeSet<_>>(), folders_with_a_test("sdk"));
}

fn folders_with_a_test(folder: &str) -> BTreeSet<String> {
    let entries = std::fs::read_dir(at_root(folder)).unwrap().map(|entry| entry.unwrap());
    let tested = entries.filter(|entry| entry.path().join("test").is_file());
    tested.map(|entry| entry.file_name().into_string().unwrap()).collect()
}

/// `bench/sizing` measures every operation that computes, and the table that it writes has one row for each.
#[test]
fn every_operation_is_sized() {
    let document = crate::support::document();
    let names = document.pointer("/components/schemas/OperationName/enum").unwrap().as_array().unwrap();
    let names: Vec<_> = names.iter().map(|name| name.as_str().unwrap()).collect();
    let script = std::fs::read_to_string(at_root("bench/sizing")).unwrap();
    let rows = script.lines().filter_map(|line| line.strip_prefix("    \"")?.split_once("\": ["));
    let measured: BTreeSet<_> = rows.map(|(name, _)| name).collect();
    assert_eq!(measured, names.iter().copied().collect());

    let page = std::fs::read_to_string(at_root("docs/operations.md")).unwrap();
    let table = page.split("of bench/sizing -->").nth(1).unwrap();
    let sized: BTreeSet<_> =
        table.lines().filter_map(|line| line.strip_prefix("| `")?.split('`').next()).collect();
    let paths = document["paths"].as_object().unwrap().iter();
    let paths = paths.filter(|(_, item)| names.iter().any(|name| item["post"]["operationId"] == **name));
    assert_eq!(sized, paths.map(|(path, _)| path.as_str()).collect());
}

#[test]
fn the_readme_is_short() {
    let page = std::fs::read_to_string(at_root("README.md")).unwrap();
    assert!(page.lines().count() <= 150, "what is more belongs into docs/");
}

#[test]
fn links_lead_somewhere() {
    let mut pages: Vec<_> =
        ["", "docs", "sdk", "sdk/python", "bench", "numerics/tests/data"].map(markdown_in).concat();
    pages.sort();
    assert!(pages.len() >= 15, "{pages:?}");
    for page in &pages {
        let text = prose(page);
        let targets = text.split("](").skip(1).map(|rest| rest.split(')').next().unwrap());
        for target in targets.filter(|target| !target.starts_with("http")) {
            let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
            let file = if file.is_empty() { page.clone() } else { page.parent().unwrap().join(file) };
            assert!(file.exists(), "{}: {target}", page.display());
            let leads_on = anchor.is_empty() || anchors(&prose(&file)).any(|known| known == anchor);
            assert!(leads_on, "{}: no heading for {target}", page.display());
        }
    }
}

fn markdown_in(folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(at_root(folder)).unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| path.extension().is_some_and(|extension| extension == "md")).collect()
}

/// Returns a page without its code blocks and comments.
fn prose(page: &Path) -> String {
    let text = std::fs::read_to_string(page).unwrap();
    let mut is_code = false;
    let lines = text.lines().filter(|line| {
        let is_fence = line.starts_with("```");
        is_code ^= is_fence;
        !is_code && !is_fence && !line.starts_with("<!--")
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// Returns the anchors of a page: its headings in lower case, without punctuation, with hyphens for spaces.
fn anchors(prose: &str) -> impl Iterator<Item = String> {
    let headings =
        prose.lines().filter(|line| line.starts_with('#')).map(|line| line.trim_start_matches('#').trim());
    headings.map(|heading| {
        let kept = heading.to_lowercase().replace(' ', "-");
        kept.chars().filter(|letter| letter.is_alphanumeric() || "-_".contains(*letter)).collect()
    })
}
