//! Clouds as rows of numbers: XYZ, CSV and the like.
//!
//! docs/operations.md has the rules ("Rows of numbers"). `page/model/tables.js` is the reader of the page,
//! and tests/tables holds both to the same outcomes.

mod head;
mod numbers;

use std::iter::Peekable;

use safetensors::Dtype;
use safetensors::tensor::{TensorView, serialize};

use head::{Columns, Head, Line, cells_of};
use numbers::{Numbers, Place};

/// Largest deviation of the lengths of normals from 1, for two decimals of each component.
const MAX_DEVIATION: f64 = 0.01;

/// Reads a table. Returns the points, and normals if there are any, as a file of tensors.
///
/// # Errors
/// Says which line is wrong, how, and where it helps what to do.
pub fn tensors_of(bytes: &[u8]) -> Result<Vec<u8>, String> {
    Table::read(bytes)?.tensors()
}

/// A cloud, with its rows one after another.
#[derive(Debug, PartialEq)]
struct Table {
    points: Vec<f64>,
    normals: Option<Vec<f64>>,
    dimension: usize,
}

impl Table {
    fn read(bytes: &[u8]) -> Result<Self, String> {
        let text =
            std::str::from_utf8(bytes).map_err(|_| "the file is not UTF-8: save it in that encoding")?;
        let mut lines = content_of(text).peekable();
        let count = take_count(&mut lines);
        let head = Head::of(*lines.peek().ok_or(NO_ROWS)?);
        let columns = head.columns()?;
        lines.next_if(|_| head.has_names);
        let mut numbers = Numbers::default();
        let (mut table, n_rows) = Self::of_rows(lines, &head, &columns, &mut numbers)?;
        if n_rows == 0 {
            return Err(NO_ROWS.to_owned());
        }
        head.check_commas(&numbers)?;
        count.map_or(Ok(()), |count| count.check(n_rows))?;
        let are_normals = |normals: &Vec<f64>| head.has_names || normals.chunks_exact(3).all(is_unit);
        table.normals = table.normals.filter(are_normals);
        Ok(table)
    }

    /// Reads all rows. Also returns their number.
    fn of_rows<'a>(
        lines: impl Iterator<Item = Line<'a>>,
        head: &Head<'_>,
        columns: &Columns,
        numbers: &mut Numbers,
    ) -> Result<(Self, usize), String> {
        let (mut points, mut normals) = (Vec::new(), columns.normals.as_ref().map(|_| Vec::new()));
        let (mut row, mut n_rows) = (Vec::new(), 0);
        for line in lines {
            let cells: Vec<&str> = cells_of(line.text, head.separator).collect();
            if cells.len() != head.width() {
                return Err(head.width_refusal(line, cells.len()));
            }
            row.clear();
            for (column, cell) in cells.into_iter().enumerate() {
                let place = Place { line: line.number, column, may_miss: !columns.is_geometric[column] };
                row.push(numbers.read(cell, place)?);
            }
            points.extend(columns.positions.iter().map(|&column| row[column]));
            if let (Some(normals), Some(columns)) = (&mut normals, &columns.normals) {
                normals.extend(columns.iter().map(|&column| row[column]));
            }
            n_rows += 1;
        }
        Ok((Self { points, normals, dimension: columns.positions.len() }, n_rows))
    }

    fn tensors(&self) -> Result<Vec<u8>, String> {
        let shape = vec![self.points.len() / self.dimension, self.dimension];
        let view = |numbers| {
            let bytes = bytemuck::cast_slice::<f64, u8>(numbers);
            TensorView::new(Dtype::F64, shape.clone(), bytes).map_err(|error| error.to_string())
        };
        let mut tensors = vec![("points", view(&self.points)?)];
        if let Some(normals) = &self.normals {
            tensors.push(("normals", view(normals)?));
        }
        serialize(tensors, None).map_err(|error| error.to_string())
    }
}

const NO_ROWS: &str = "the file has no rows";

/// Lines that are neither blank nor comments.
fn content_of(text: &str) -> impl Iterator<Item = Line<'_>> {
    // Spreadsheets begin a text with a mark of its encoding.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines = text.lines().enumerate().map(|(at, text)| Line { number: at + 1, text });
    lines.filter(|line| {
        let text = line.text.trim_start_matches([' ', '\t']);
        !text.is_empty() && !text.starts_with('#') && !text.starts_with("//")
    })
}

/// The number of points that an XYZ file may begin with.
struct Count<'a> {
    line: usize,
    announced: &'a str,
}

/// Takes the number of points from the lines, if there is one, and the comment that may follow it.
fn take_count<'a>(lines: &mut Peekable<impl Iterator<Item = Line<'a>>>) -> Option<Count<'a>> {
    let announced = |line: &Line<'a>| line.text.trim_matches([' ', '\t']);
    let first = lines.next_if(|line| announced(line).bytes().all(|digit| digit.is_ascii_digit()))?;
    lines.next_if(|line| line.number == first.number + 1 && Head::of(*line).is_comment());
    Some(Count { line: first.number, announced: announced(&first) })
}

impl Count<'_> {
    fn check(&self, n_rows: usize) -> Result<(), String> {
        let Self { line, announced } = self;
        let announced_rows = announced.parse::<usize>().ok();
        if announced_rows == Some(n_rows) {
            return Ok(());
        }
        let points = if announced_rows == Some(1) { "point" } else { "points" };
        let rows = if n_rows == 1 { "row follows" } else { "rows follow" };
        Err(format!("line {line} announces {announced} {points}, but {n_rows} {rows}"))
    }
}

fn is_unit(normal: &[f64]) -> bool {
    (normal.iter().map(|x| x * x).sum::<f64>().sqrt() - 1.0).abs() <= MAX_DEVIATION
}

#[cfg(test)]
mod tests;
