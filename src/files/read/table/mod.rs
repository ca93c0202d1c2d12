//! Clouds as rows of numbers: XYZ, CSV and the like.
//!
//! docs/formats.md has the rules ("Rows of numbers"). `page/model/tables.js` is the reader of the page, and
//! tests/tables holds both to the same outcomes.

mod head;
mod numbers;

use std::iter::Peekable;

use super::columns::{Columns, Gaps, NORMALS, POSITIONS, Places};
use super::{FileCloud, text_of};
use head::{Head, Line, cells_of};
use numbers::{Numbers, Place};

/// Largest deviation of the lengths of normals from 1, for two decimals of each component.
const MAX_DEVIATION: f64 = 0.01;

/// Reads a table.
///
/// # Errors
/// Says which line is wrong, how, and where it helps what to do.
pub fn read(bytes: &[u8]) -> Result<FileCloud, String> {
    columns_of(text_of(bytes)?)?.into_cloud(Gaps::Refused)
}

fn columns_of(text: &str) -> Result<Columns, String> {
    let mut lines = content_of(text).peekable();
    let count = take_count(&mut lines);
    let head = Head::of(*lines.peek().ok_or(NO_ROWS)?);
    let names = head.names()?;
    lines.next_if(|_| head.has_names);
    let mut numbers = Numbers::default();
    let mut columns = rows_of(lines, &head, names, &mut numbers)?;
    let n_rows = columns.n_rows();
    if n_rows == 0 {
        return Err(NO_ROWS.to_owned());
    }
    head.check_commas(&numbers)?;
    count.map_or(Ok(()), |count| count.check(n_rows))?;
    if !head.has_names && columns.names.len() == 6 && are_normals(&columns.numbers[3..]) {
        for (name, normal) in columns.names[3..].iter_mut().zip(NORMALS[0]) {
            normal.clone_into(name);
        }
    }
    Ok(columns)
}

/// Reads all rows.
fn rows_of<'a>(
    lines: impl Iterator<Item = Line<'a>>,
    head: &Head<'_>,
    names: Vec<String>,
    numbers: &mut Numbers,
) -> Result<Columns, String> {
    let may_miss: Vec<bool> = names.iter().map(|name| !is_geometric(name)).collect();
    let mut columns = vec![Vec::new(); names.len()];
    let mut places = Vec::new();
    for line in lines {
        let cells: Vec<&str> = cells_of(line.text, head.separator).collect();
        if cells.len() != head.width() {
            return Err(head.width_refusal(line, cells.len()));
        }
        for (column, cell) in cells.into_iter().enumerate() {
            let place = Place { line: line.number, column, may_miss: may_miss[column] };
            columns[column].push(numbers.read(cell, place)?);
        }
        places.push(line.number);
    }
    Ok(Columns { names, numbers: columns, places: Places::Lines(places) })
}

/// Whether a column is one of positions or normals, which have no missing numbers.
fn is_geometric(name: &str) -> bool {
    POSITIONS.iter().chain(NORMALS.as_flattened()).any(|other| other.eq_ignore_ascii_case(name))
}

const NO_ROWS: &str = "the file has no rows";

/// Lines that are neither blank nor comments.
fn content_of(text: &str) -> impl Iterator<Item = Line<'_>> {
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

fn are_normals(columns: &[Vec<f64>]) -> bool {
    let length = |row: usize| columns.iter().map(|column| column[row].powi(2)).sum::<f64>().sqrt();
    let n_rows = columns.first().map_or(0, Vec::len);
    (0..n_rows).all(|row| (length(row) - 1.0).abs() <= MAX_DEVIATION)
}
