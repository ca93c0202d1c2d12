//! Tables of the paper's numbers beside ours.

use std::fmt;

/// An experiment's results.
pub struct Table {
    pub title: &'static str,
    pub columns: Vec<&'static str>,
    pub rows: Vec<Row>,
}

/// A row of results.
pub struct Row {
    pub label: String,
    pub cells: Vec<Cell>,
}

/// A result, beside the paper's.
#[derive(Clone, Copy)]
pub struct Cell {
    pub paper: Paper,
    /// The number found, `None` where there is no answer: the gradient vanishes, or no level line is found.
    pub ours: Option<f64>,
}

/// The kind of result that the paper prints.
#[derive(Clone, Copy)]
pub enum Paper {
    Number(f64),
    /// A picture without numbers.
    Figure,
    /// Nothing: the result is only ours.
    Nothing,
}

impl Row {
    /// A row of the paper's numbers beside ours.
    pub fn beside(label: impl Into<String>, paper: &[f64], ours: &[f64]) -> Self {
        assert_eq!(paper.len(), ours.len());
        let cell = |(&paper, &ours): (&f64, &f64)| Cell { paper: Paper::Number(paper), ours: Some(ours) };
        Self { label: label.into(), cells: paper.iter().zip(ours).map(cell).collect() }
    }

    /// A row of our numbers beside a picture or nothing.
    pub fn of(label: impl Into<String>, paper: Paper, ours: &[f64]) -> Self {
        let cell = |&ours: &f64| Cell { paper, ours: Some(ours) };
        Self { label: label.into(), cells: ours.iter().map(cell).collect() }
    }
}

impl Table {
    /// A table of measurements where the paper has only pictures: one column without a name.
    pub fn of_figure(title: &'static str, facts: &[(&str, f64)]) -> Self {
        let row = |&(label, ours): &(&str, f64)| Row::of(label, Paper::Figure, &[ours]);
        Self { title, columns: vec![""], rows: facts.iter().map(row).collect() }
    }
}

/// Prints the paper's number and ours under each column.
impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let label_width = self.rows.iter().map(|row| row.label.chars().count()).max().unwrap_or(0);
        writeln!(f, "{}", self.title)?;
        if self.columns != [""] {
            write!(f, "{:label_width$}", "")?;
            self.columns.iter().try_for_each(|column| write!(f, " | {column:^19}"))?;
            writeln!(f)?;
        }
        write!(f, "{:label_width$}", "")?;
        self.columns.iter().try_for_each(|_| write!(f, " | {:>9} {:>9}", "paper", "ours"))?;
        writeln!(f)?;
        for row in &self.rows {
            write!(f, "{:label_width$}", row.label)?;
            row.cells.iter().try_for_each(|cell| write!(f, " | {cell}"))?;
            writeln!(f)?;
        }
        Ok(())
    }
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let paper = match self.paper {
            Paper::Number(number) => short(number),
            Paper::Figure => "figure".to_owned(),
            Paper::Nothing => "-".to_owned(),
        };
        write!(f, "{paper:>9} {:>9}", self.ours.map_or("null".to_owned(), short))
    }
}

/// Formats whole numbers below 1e4 as they are, moderate numbers with four or five digits, others with three.
fn short(number: f64) -> String {
    match number.abs() {
        x if x < 1e4 && x.fract() == 0.0 => format!("{number:.0}"),
        x if (0.1..10.0).contains(&x) => format!("{number:.4}"),
        x if (10.0..1e4).contains(&x) => format!("{number:.1}"),
        _ => format!("{number:.2e}"),
    }
}
