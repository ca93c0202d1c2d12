//! Clouds as rows of numbers: XYZ, CSV and the like.

use safetensors::Dtype;
use safetensors::tensor::{TensorView, serialize};

/// Names of columns of positions and normals. Without a first line of names, columns are these in order.
const POSITIONS: [&str; 3] = ["x", "y", "z"];
const NORMALS: [&str; 3] = ["nx", "ny", "nz"];

/// Reads rows of two, three or six numbers, separated by white space, commas or semicolons. The first
/// line may name the columns. Lines that begin with # are passed over.
///
/// Returns the points, and normals if there are any, as a file of tensors.
///
/// # Errors
/// Says which line is wrong, and how.
pub fn tensors_of(text: &str) -> Result<Vec<u8>, String> {
    // Spreadsheets begin a text with a mark of its encoding.
    let text = text.trim_start_matches('\u{feff}');
    let is_content =
        |(_, line): &(usize, &str)| !line.trim().is_empty() && !line.trim_start().starts_with('#');
    let mut lines = text.lines().enumerate().filter(is_content).peekable();
    let first = lines.peek().map(|(_, line)| cells(line).map(str::to_lowercase).collect::<Vec<_>>());
    let first = first.ok_or("the file has no rows")?;
    let has_names = first.iter().any(|cell| cell.parse::<f64>().is_err());
    let names: Vec<String> = if has_names {
        lines.next();
        first
    } else {
        let known = if first.len() == 6 { 6 } else { 3 };
        let all = POSITIONS.iter().chain(&NORMALS).take(known).map(|name| (*name).to_owned());
        all.take(first.len()).collect()
    };
    let place = |name: &&str| names.iter().position(|other| other == name);
    let positions: Vec<usize> = POSITIONS.iter().filter_map(place).collect();
    if positions.len() < 2 {
        return Err(format!("no columns x and y among {}", names.join(", ")));
    }
    let normals: Vec<usize> = NORMALS.iter().take(positions.len()).filter_map(place).collect();
    let has_normals = normals.len() == positions.len();
    let (mut points, mut directions, mut row) = (Vec::new(), Vec::new(), Vec::new());
    for (at, line) in lines {
        row.clear();
        for cell in cells(line) {
            row.push(cell.parse::<f64>().map_err(|_| format!("line {}: {cell:?} is no number", at + 1))?);
        }
        if row.len() < names.len() {
            return Err(format!("line {} has {} numbers, expected {}", at + 1, row.len(), names.len()));
        }
        points.extend(positions.iter().map(|&column| row[column]));
        if has_normals {
            directions.extend(normals.iter().map(|&column| row[column]));
        }
    }
    file_of(&points, has_normals.then_some(&directions), positions.len())
}

fn cells(line: &str) -> impl Iterator<Item = &str> {
    line.split([',', ';', ' ', '\t']).map(|cell| cell.trim_matches('"')).filter(|cell| !cell.is_empty())
}

fn file_of(points: &[f64], normals: Option<&Vec<f64>>, dimension: usize) -> Result<Vec<u8>, String> {
    let bytes_of = |numbers: &[f64]| numbers.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let shape = vec![points.len() / dimension, dimension];
    let (of_points, of_normals) = (bytes_of(points), normals.map(|normals| bytes_of(normals)));
    let view = |bytes| TensorView::new(Dtype::F64, shape.clone(), bytes).map_err(|error| error.to_string());
    let mut tensors = vec![("points", view(&of_points)?)];
    if let Some(bytes) = &of_normals {
        tensors.push(("normals", view(bytes)?));
    }
    serialize(tensors, None).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use safetensors::SafeTensors;

    fn numbers(file: &[u8], name: &str) -> (Vec<usize>, Vec<f64>) {
        let found = SafeTensors::deserialize(file).unwrap();
        let tensor = found.tensor(name).unwrap();
        let numbers =
            tensor.data().chunks_exact(8).map(|bytes| f64::from_le_bytes(bytes.try_into().unwrap()));
        (tensor.shape().to_vec(), numbers.collect())
    }

    #[test]
    fn rows_are_read_with_and_without_names_and_in_any_order() {
        let plain = tensors_of("# a scan\n1 2 3\n\n4,5, 6\n").unwrap();
        assert_eq!(numbers(&plain, "points"), (vec![2, 3], vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
        let named = tensors_of("Y;label;X\n2;7;1\n4;7;3\n").unwrap();
        assert_eq!(numbers(&named, "points"), (vec![2, 2], vec![1.0, 2.0, 3.0, 4.0]));
        let six = tensors_of("1 2 3 0 0 1\n").unwrap();
        assert_eq!(numbers(&six, "normals"), (vec![1, 3], vec![0.0, 0.0, 1.0]));
    }

    #[test]
    fn a_wrong_line_is_named() {
        assert_eq!(tensors_of("1 2 3\n4 five 6\n").unwrap_err(), "line 2: \"five\" is no number");
        assert_eq!(tensors_of("1 2 3\n4 5\n").unwrap_err(), "line 2 has 2 numbers, expected 3");
        assert_eq!(tensors_of("a,b\n1,2\n").unwrap_err(), "no columns x and y among a, b");
        assert_eq!(tensors_of("# nothing\n").unwrap_err(), "the file has no rows");
    }
}
