//! Values of many expansions over the same centres. Kernel values are computed once for all of them.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef};

use super::gram::fill_cross_gram;
use super::nodes::Nodes;
use crate::error::{NumericsError, Result};
use crate::kernel::Kernel;
use crate::machine::parallelism::parallelism;
use crate::observer::Observer;
use crate::points::cloud::Cloud;

/// Queries per block: kernel values of one block are held at a time.
pub(crate) const QUERIES_PER_BLOCK: usize = 256;

/// Evaluates `Σ_j λ_ij k(x, z_j)` for k sets of weights `[k, r]` at queries `[m, d]`. The result is `[k, m]`.
///
/// # Errors
/// [`NumericsError::Overflow`] if a result leaves float64, [`NumericsError::Cancelled`].
pub(crate) fn values_of_each(
    centres: &Cloud,
    kernel: &Kernel,
    weights: &[f64],
    queries: &Cloud,
    observer: &dyn Observer,
) -> Result<Vec<f64>> {
    let (r, m, d) = (centres.n_points(), queries.n_points(), queries.dimension());
    let k = weights.len() / r;
    let nodes = Nodes::of(centres);
    let weights = MatRef::from_column_major_slice(weights, r, k);
    let mut values = vec![0.0; k * m];
    let mut buffer = vec![0.0; r * QUERIES_PER_BLOCK.min(m)];
    let blocks = queries.coordinates().chunks(QUERIES_PER_BLOCK * d);
    for (block, rows) in blocks.enumerate() {
        let block_of_queries = Cloud::new(rows.to_vec(), d)?;
        let width = block_of_queries.n_points();
        let cross = &mut buffer[..r * width];
        fill_cross_gram(&nodes, kernel, &block_of_queries, cross, observer)?;
        let cross = MatRef::from_column_major_slice(cross, r, width);
        let out = MatMut::from_column_major_slice_mut(&mut values, m, k);
        let out = out.submatrix_mut(block * QUERIES_PER_BLOCK, 0, width, k);
        matmul(out, Accum::Replace, cross.transpose(), weights, 1.0, parallelism((2 * r * width * k) as f64));
    }
    match values.iter().position(|value| !value.is_finite()) {
        Some(at) => Err(NumericsError::Overflow { query: at % m }),
        None => Ok(values),
    }
}
