//! Access to tables, and bounds on their errors, for the tests.

use super::table::{Cell, Paper, Row, Table};

impl Table {
    /// The row with a label.
    pub fn row(&self, label: &str) -> &Row {
        self.rows.iter().find(|row| row.label == label).expect("a label of this table")
    }

    /// Our number in a row of one column.
    pub fn fact(&self, label: &str) -> f64 {
        self.row(label).ours()[0]
    }
}

impl Row {
    /// Our numbers, none of them null.
    pub fn ours(&self) -> Vec<f64> {
        self.cells.iter().map(|cell| cell.ours.expect("the gradient vanishes nowhere in this row")).collect()
    }
}

/// Asserts that every error is below 3 times the paper's, and that most are below the paper's.
///
/// The factor 3 allows for the paper's single random draw, and for definitions that the paper leaves open: of
/// the relative error, and of the average.
pub fn assert_errors_are_the_papers_or_smaller(rows: &[Row]) {
    let ratios: Vec<f64> = rows.iter().flat_map(|row| &row.cells).map(ratio).collect();
    assert!(ratios.iter().all(|&ratio| ratio < 3.0), "{ratios:?}");
    assert!(ratios.iter().filter(|&&ratio| ratio < 1.0).count() > ratios.len() / 2, "{ratios:?}");
}

fn ratio(cell: &Cell) -> f64 {
    match (cell.paper, cell.ours) {
        (Paper::Number(paper), Some(ours)) => ours / paper,
        _ => f64::NAN,
    }
}
