//! CSV: a first line with the names of the columns, then a row for each point, to the last digit.

use std::fmt::Write;

use super::table::Table;

/// Writes all columns. Numbers that are missing are `NaN`, which the readers of tables take.
pub fn write(table: &Table) -> Vec<u8> {
    let columns = table.all_columns();
    let names: Vec<String> = columns.iter().map(|(name, _)| quoted(name)).collect();
    let mut text = names.join(",") + "\n";
    for row in 0..table.n_rows() {
        for (at, (_, column)) in columns.iter().enumerate() {
            let separator = if at == 0 { "" } else { "," };
            // Writing to a string never fails.
            let _ = write!(text, "{separator}{}", column.at(row));
        }
        text.push('\n');
    }
    text.into_bytes()
}

/// A name between quotes where it has a comma, a quote or a line of its own in it (RFC 4180).
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', ';']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}
