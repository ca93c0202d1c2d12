//! The readers, held to the files and outcomes of tests/tables and tests/clouds, as those of the page and of
//! the Python package are. And to files that end anywhere, or have a wrong byte.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use super::formats::{FORMATS, endings};
use super::{FileCloud, read};

/// Name of the reader in outcomes that differ among readers.
const READER: &str = "command";

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(name)
}

fn outcomes(folder: &Path) -> Map<String, Value> {
    let text = std::fs::read_to_string(folder.join("expected.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

fn rows(numbers: &[f64], width: usize) -> Value {
    numbers.chunks_exact(width).map(|row| json!(row)).collect()
}

/// A cloud in the form of expected.json, where null is a value that is missing or infinite.
fn outcome_of(cloud: &FileCloud) -> Value {
    let mut outcome = json!({"points": rows(&cloud.points, cloud.dimension)});
    if let Some(normals) = &cloud.normals {
        outcome["normals"] = rows(normals, cloud.dimension);
    }
    if let Some(colours) = &cloud.colours {
        outcome["colours"] = rows(colours, 3);
    }
    for (name, column) in &cloud.columns {
        outcome["values"][name] = json!(column);
    }
    if let Some(sentence) = cloud.left_out() {
        outcome["left_out"] = json!(sentence);
    }
    outcome
}

/// Whole numbers, parsed as floats.
fn as_floats(value: &Value) -> Value {
    match value {
        Value::Array(entries) => entries.iter().map(as_floats).collect(),
        Value::Object(members) => {
            members.iter().map(|(name, member)| (name.clone(), as_floats(member))).collect()
        }
        Value::Number(number) => json!(number.as_f64()),
        other => other.clone(),
    }
}

/// Compares what was read with an outcome. A refusal that ends with "…" is the beginning of one.
fn check(name: &str, bytes: &[u8], expected: &Value) {
    let expected = expected.get(READER).unwrap_or(expected);
    match (read(name, bytes), expected["refused"].as_str()) {
        (Ok(cloud), _) => assert_eq!(outcome_of(&cloud), as_floats(expected), "{name}"),
        (Err(error), None) => panic!("{name}: {error}"),
        (Err(error), Some(sentence)) => match sentence.strip_suffix('…') {
            Some(beginning) => assert!(error.to_string().starts_with(beginning), "{name}: {error}"),
            None => assert_eq!(error.to_string(), sentence, "{name}"),
        },
    }
}

#[test]
fn every_sample_has_its_outcome() {
    for name in ["tables", "clouds"] {
        let folder = folder(name);
        let files = std::fs::read_dir(&folder).unwrap().map(|file| file.unwrap().file_name());
        let files: BTreeSet<String> = files.map(|file| file.into_string().unwrap()).collect();
        let expected = outcomes(&folder);
        let others = ["expected.json", "make_samples"].map(str::to_owned);
        let named: BTreeSet<String> = expected.keys().cloned().collect();
        assert_eq!(files.into_iter().filter(|file| !others.contains(file)).collect::<BTreeSet<_>>(), named);
        for (file, outcome) in &expected {
            check(file, &std::fs::read(folder.join(file)).unwrap(), outcome);
        }
    }
}

/// Files that end early, or have a wrong byte, are read or refused, and never more than that: nothing is
/// allocated by their word, and nothing panics.
#[test]
fn damaged_samples_are_read_or_refused() {
    let folder = folder("clouds");
    for (name, outcome) in outcomes(&folder) {
        let whole = std::fs::read(folder.join(&name)).unwrap();
        let is_refused = outcome.get(READER).unwrap_or(&outcome).get("refused").is_some();
        for n_bytes in 0..whole.len() {
            let _ = read(&name, &whole[..n_bytes]);
        }
        if is_refused {
            continue;
        }
        for at in 0..whole.len() {
            for flipped in [1u8, 0x80, 0xff] {
                let mut damaged = whole.clone();
                damaged[at] ^= flipped;
                if let Ok(cloud) = read(&name, &damaged) {
                    assert!(cloud.points.iter().all(|x| x.is_finite()), "{name}, byte {at} ^ {flipped}");
                    assert_eq!(cloud.points.len(), cloud.n_points() * cloud.dimension);
                }
            }
        }
    }
}

#[test]
fn the_documents_have_all_formats() {
    let text = std::fs::read_to_string(folder("../docs/formats.md")).unwrap();
    for format in &FORMATS {
        let endings: Vec<String> = format.endings.iter().map(|ending| format!("`.{ending}`")).collect();
        let row = format!("| {} | {} | {} |", format.name, endings.join(", "), format.reads);
        assert!(text.contains(&row), "docs/formats.md lacks the row\n{row}");
    }
    let n_rows = text.lines().filter(|line| line.contains("| `.")).count();
    assert_eq!(n_rows, FORMATS.len());
    assert!(endings().starts_with(".ply, .xyz, .csv"));
}
