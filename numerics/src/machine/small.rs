//! Vectors and matrices of a few numbers, on the stack.

use smallvec::SmallVec;

/// A short vector of f64. Up to 16 numbers, a matrix in four dimensions, are on the stack, more on the heap.
pub(crate) type Small = SmallVec<[f64; 16]>;

/// Returns `n` zeros.
pub(crate) fn zeros(n: usize) -> Small {
    Small::from_elem(0.0, n)
}
