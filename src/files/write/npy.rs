//! npy: a structured array with a field for each column (`NumPy` Enhancement Proposal 1, version 3.0).

use super::table::Table;

const MAGIC: [u8; 8] = *b"\x93NUMPY\x03\x00";
const ALIGNMENT: usize = 64;

/// Writes rows of float64, one field for each column.
pub fn write(table: &Table) -> Vec<u8> {
    let columns = table.all_columns();
    let field = |name: &str| format!("('{}', '<f8')", name.replace('\\', "\\\\").replace('\'', "\\'"));
    let fields: Vec<String> = columns.iter().map(|(name, _)| field(name)).collect();
    let mut header = format!(
        "{{'descr': [{}], 'fortran_order': False, 'shape': ({},), }}",
        fields.join(", "),
        table.n_rows()
    );
    let n_before = MAGIC.len() + size_of::<u32>();
    let n_header = (n_before + header.len() + 1).next_multiple_of(ALIGNMENT) - n_before;
    header.push_str(&" ".repeat(n_header - header.len() - 1));
    header.push('\n');
    let mut out = MAGIC.to_vec();
    out.extend((header.len() as u32).to_le_bytes());
    out.extend(header.into_bytes());
    for row in 0..table.n_rows() {
        columns.iter().for_each(|(_, column)| out.extend(column.at(row).to_le_bytes()));
    }
    out
}
