//! Sparse matrices by rows.

use rayon::prelude::*;

use super::row::Row;

/// A sparse matrix by rows (CSR), with one list of numbers per component.
///
/// Entry `at` of row i, `indptr[i] ≤ at < indptr[i + 1]`, is in column `indices[at]`.
#[derive(Debug, Clone, PartialEq)]
pub struct SparseMatrix {
    /// Numbers per entry: 1, or d for a gradient. The length of `data` does not show it where all rows are
    /// empty.
    pub n_components: usize,
    /// Start of each row in `indices`, `[m + 1]`.
    pub indptr: Vec<i64>,
    /// Columns of the entries, ascending within a row.
    pub indices: Vec<i64>,
    /// Numbers, `[components, entries]`: 1/L² for the Laplace–Beltrami operator, 1/L for the surface
    /// gradient.
    pub data: Vec<f64>,
}

impl SparseMatrix {
    pub(super) fn of(rows: &[Row], n_components: usize) -> Self {
        let n_entries = rows.iter().map(|row| row.columns.len()).sum();
        let mut indptr = Vec::with_capacity(rows.len() + 1);
        let mut indices = Vec::with_capacity(n_entries);
        indptr.push(0);
        for row in rows {
            indices.extend(row.columns.iter().map(|&column| i64::from(column)));
            indptr.push(indices.len() as i64);
        }
        let mut data = Vec::with_capacity(n_entries * n_components);
        for component in 0..n_components {
            for row in rows {
                let n = row.columns.len();
                data.extend_from_slice(&row.weights[component * n..][..n]);
            }
        }
        Self { n_components, indptr, indices, data }
    }

    /// Returns the products with values at the nodes, `[components, m]`.
    pub fn apply(&self, values: &[f64]) -> Vec<f64> {
        let (m, n_entries) = (self.indptr.len() - 1, self.indices.len());
        let of_row = |component: usize, row: usize| {
            let range = self.indptr[row] as usize..self.indptr[row + 1] as usize;
            let weights = &self.data[component * n_entries..][range.clone()];
            weights.iter().zip(&self.indices[range]).map(|(w, &column)| w * values[column as usize]).sum()
        };
        (0..self.n_components * m).into_par_iter().map(|at| of_row(at / m, at % m)).collect()
    }
}
