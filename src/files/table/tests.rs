//! The reader, held to the files and outcomes of tests/tables, as the reader of the page is.

use std::collections::BTreeSet;
use std::path::PathBuf;

use safetensors::SafeTensors;
use serde_json::{Map, Value, json};

use super::{Table, tensors_of};

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/tables")
}

fn outcomes() -> Map<String, Value> {
    let text = std::fs::read_to_string(folder().join("expected.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// The outcome of a file in the form of expected.json, without the values that only the page reads.
fn outcome_of(name: &str) -> Value {
    let read = Table::read(&std::fs::read(folder().join(name)).unwrap());
    let table = match read {
        Ok(table) => table,
        Err(refused) => return json!({ "refused": refused }),
    };
    let rows =
        |numbers: &Vec<f64>| numbers.chunks_exact(table.dimension).map(|row| json!(row)).collect::<Value>();
    let mut outcome = json!({"points": rows(&table.points)});
    if let Some(normals) = &table.normals {
        outcome["normals"] = rows(normals);
    }
    outcome
}

/// Whole numbers, parsed as floats.
fn as_floats(value: &Value) -> Value {
    match value {
        Value::Array(entries) => entries.iter().map(as_floats).collect(),
        Value::Number(number) => json!(number.as_f64()),
        other => other.clone(),
    }
}

#[test]
fn every_sample_has_its_outcome() {
    let files = std::fs::read_dir(folder()).unwrap();
    let files: BTreeSet<String> =
        files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    let expected = outcomes();
    let named = expected.keys().cloned().chain(["expected.json".to_owned()]);
    assert_eq!(files, named.collect());
    for (name, outcome) in &expected {
        let members = ["points", "normals", "refused"].into_iter();
        let known = members.filter_map(|member| Some((member.to_owned(), as_floats(outcome.get(member)?))));
        assert_eq!(outcome_of(name), Value::Object(known.collect()), "{name}");
    }
}

#[test]
fn a_table_becomes_a_file_of_tensors() {
    let file = tensors_of(b"x;y;nx;ny\n1,5;2;0;1\n3;4;1;0\n").unwrap();
    let found = SafeTensors::deserialize(&file).unwrap();
    for (name, expected) in [("points", [1.5, 2.0, 3.0, 4.0]), ("normals", [0.0, 1.0, 1.0, 0.0])] {
        let tensor = found.tensor(name).unwrap();
        let bytes = tensor.data().chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap()));
        assert_eq!((tensor.shape(), bytes.collect::<Vec<_>>()), (&[2, 2][..], expected.to_vec()));
    }
}
