//! The first line of a table, which decides the separator, the number of columns and what they are.

use super::super::columns::POSITIONS;
use super::numbers::{Numbers, Shape, is_decimal_comma, is_of_marks};

/// A line of a file, counted from 1.
#[derive(Clone, Copy)]
pub struct Line<'a> {
    pub number: usize,
    pub text: &'a str,
}

/// Separator of the cells of every line.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Separator {
    Semicolons,
    Tabs,
    Commas,
    Spaces,
}

impl Separator {
    /// Commas between spaces are decimal marks, if every word is such a number.
    fn of(line: &str) -> Self {
        let mut words = line.split(' ').filter(|word| !word.is_empty());
        if line.contains(';') {
            Self::Semicolons
        } else if line.contains('\t') {
            Self::Tabs
        } else if !line.contains(',') || (words.clone().count() >= 2 && words.all(is_decimal_comma)) {
            Self::Spaces
        } else {
            Self::Commas
        }
    }

    fn character(self) -> char {
        match self {
            Self::Semicolons => ';',
            Self::Tabs => '\t',
            Self::Commas => ',',
            Self::Spaces => ' ',
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Semicolons => "semicolons",
            Self::Tabs => "tabs",
            Self::Commas => "commas",
            Self::Spaces => "spaces",
        }
    }
}

/// The cells of a line, without blanks and quotes around them.
pub fn cells_of(line: &str, separator: Separator) -> impl Iterator<Item = &str> {
    let are_kept = separator != Separator::Spaces;
    let cells = line.split(separator.character()).filter(move |cell| are_kept || !cell.is_empty());
    cells.map(|cell| {
        let cell = cell.trim_matches([' ', '\t']);
        cell.strip_prefix('"').and_then(|cell| cell.strip_suffix('"')).unwrap_or(cell)
    })
}

/// The first line of a table.
pub struct Head<'a> {
    pub line: usize,
    pub separator: Separator,
    pub has_names: bool,
    cells: Vec<&'a str>,
}

impl<'a> Head<'a> {
    pub fn of(line: Line<'a>) -> Self {
        let separator = Separator::of(line.text);
        let cells: Vec<&str> = cells_of(line.text, separator).collect();
        let has_names = cells.iter().all(|cell| cell.is_empty() || is_name(cell))
            && cells.iter().any(|cell| !cell.is_empty());
        Self { line: line.number, separator, has_names, cells }
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.cells.len()
    }

    /// Whether a line after the number of points is no part of the table.
    pub fn is_comment(&self) -> bool {
        if self.has_names {
            !has_positions(&self.lower_names())
        } else {
            self.cells.iter().any(|cell| Shape::of(cell).is_none())
        }
    }

    fn lower_names(&self) -> Vec<String> {
        let numbered =
            |at, cell: &str| if cell.is_empty() { format!("column {}", at + 1) } else { cell.to_lowercase() };
        self.cells.iter().enumerate().map(|(at, cell)| numbered(at, cell)).collect()
    }

    /// The names of all columns. Columns without one are numbered.
    ///
    /// # Errors
    /// Refuses a table without x and y, and names that stand twice.
    pub fn names(&self) -> Result<Vec<String>, String> {
        let line = self.line;
        let numbered = |at: usize| format!("column {}", at + 1);
        if !self.has_names {
            if self.width() < 2 {
                return Err(format!("line {line}: a row has at least two coordinates"));
            }
            let name = |at| POSITIONS.get(at).map_or_else(|| numbered(at), |&axis| axis.to_owned());
            return Ok((0..self.width()).map(name).collect());
        }
        let lower = self.lower_names();
        if !has_positions(&lower) {
            return Err(format!("line {line} names no columns x and y: {}", self.cells.join(", ")));
        }
        if let Some((_, twice)) = lower.iter().enumerate().find(|(at, name)| lower[..*at].contains(name)) {
            return Err(format!("line {line} names {twice} twice"));
        }
        let name =
            |(at, cell): (usize, &&str)| if cell.is_empty() { numbered(at) } else { (*cell).to_owned() };
        Ok(self.cells.iter().enumerate().map(name).collect())
    }

    /// Refuses a table whose commas can be read in two ways.
    ///
    /// # Errors
    /// Says where, and what to write instead.
    pub fn check_commas(&self, numbers: &Numbers) -> Result<(), String> {
        if let Some(doubt) = numbers.doubt() {
            return Err(doubt.clone());
        }
        // Decimal commas double the number of columns, and leave no point.
        let is_double = self.width() >= 4 && self.width().is_multiple_of(2);
        let may_be_torn = self.separator == Separator::Commas && !self.has_names && is_double;
        if may_be_torn && !numbers.has_point() {
            let remedy = "Name the columns in a first line, or write decimal points";
            return Err(format!("line {}: commas may be decimal marks here. {remedy}", self.line));
        }
        Ok(())
    }

    /// The refusal of a row with another number of cells.
    pub fn width_refusal(&self, row: Line<'_>, width: usize) -> String {
        let (line, expected, between) = (self.line, self.width(), self.separator.name());
        let cells = if width == 1 { "cell" } else { "cells" };
        let remedy = match self.separator {
            Separator::Commas => ". Numbers with decimal commas need semicolons or tabs between them",
            _ => "",
        };
        format!(
            "line {} has {width} {cells} between {between}, but line {line} has {expected}{remedy}",
            row.number
        )
    }
}

fn has_positions(names: &[String]) -> bool {
    POSITIONS[..2].iter().all(|axis| names.iter().any(|name| name == axis))
}

/// Whether a text can name a column: it has more than digits and marks, and is no number.
fn is_name(cell: &str) -> bool {
    !is_of_marks(cell) && Shape::of(cell).is_none()
}
