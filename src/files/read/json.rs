//! Clouds in JSON: rows of coordinates, alone or as `points`, which may stand in `cloud` as in a request.

use serde_json::Value;

use super::{FileCloud, text_of};

/// Reads points, and normals and values if there are any.
pub fn read(bytes: &[u8]) -> Result<FileCloud, String> {
    let document: Value =
        serde_json::from_str(text_of(bytes)?).map_err(|error| format!("the file is not JSON: {error}"))?;
    let cloud = document.get("cloud").unwrap_or(&document);
    let points = if cloud.is_array() { Some(cloud) } else { cloud.get("points") };
    let rows = points.and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
    let dimension = rows.first().and_then(Value::as_array).map_or(0, Vec::len);
    if dimension == 0 {
        return Err("the JSON needs points: rows of coordinates".to_owned());
    }
    let member = |name: &str| cloud.get(name).filter(|value| !value.is_null());
    let normals = member("normals").map(|rows_of_normals| {
        let normals = rows_of_normals.as_array().filter(|normals| normals.len() == rows.len());
        let normals = normals
            .ok_or_else(|| format!("normals must have one row for each of the {} points", rows.len()))?;
        table("normals", normals, dimension)
    });
    let values = member("values").or_else(|| document.get("values")).filter(|value| !value.is_null());
    let values = values.map(|values| numbers("values", values, rows.len())).transpose()?;
    Ok(FileCloud {
        points: table("points", rows, dimension)?,
        dimension,
        normals: normals.transpose()?,
        columns: values.map(|values| ("values".to_owned(), values)).into_iter().collect(),
        ..FileCloud::default()
    })
}

fn table(member: &str, rows: &[Value], dimension: usize) -> Result<Vec<f64>, String> {
    let mut table = Vec::with_capacity(rows.len() * dimension);
    for (at, row) in rows.iter().enumerate() {
        table.extend(numbers(&format!("{member}[{at}]"), row, dimension)?);
    }
    Ok(table)
}

fn numbers(member: &str, row: &Value, n: usize) -> Result<Vec<f64>, String> {
    let row = row.as_array().filter(|row| row.len() == n);
    let numbers = row.and_then(|row| row.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>());
    numbers.ok_or_else(|| format!("{member} is not a row of {n} numbers"))
}
