//! The number of threads for a product of matrices.

use faer::Par;

/// Flops below which waking other threads costs more than it gains.
const SEQUENTIAL_FLOPS: f64 = 1e6;

/// Returns the parallelism for work of this many flops, in the rayon pool of the calling thread.
pub(crate) fn parallelism(flops: f64) -> Par {
    let n_threads = rayon::current_num_threads();
    if n_threads == 1 || flops < SEQUENTIAL_FLOPS { Par::Seq } else { Par::rayon(n_threads) }
}
