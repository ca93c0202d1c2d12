//! Vectors and matrices of a few numbers, on the stack.

use smallvec::SmallVec;

/// As many numbers as a matrix in four dimensions has; beyond them they go to the heap.
pub(crate) type Small = SmallVec<[f64; 16]>;

/// So many zeros.
pub(crate) fn zeros(n: usize) -> Small {
    Small::from_elem(0.0, n)
}
