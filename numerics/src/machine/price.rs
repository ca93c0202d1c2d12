//! What work takes, known before it is begun.
//!
//! Flops are those of a large factorization, so that all prices compare: a sum over pairs takes longer for each of its
//! operations. Every room has the prices of what it computes in a file `price.rs`, or beside the function.

/// Bytes and flops; `usize::MAX` bytes for what cannot be counted.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Price {
    pub n_bytes: usize,
    pub flops: f64,
}

impl Price {
    /// The price of so many numbers in float64, and flops.
    pub fn of_numbers(n_numbers: usize, flops: f64) -> Self {
        Self { n_bytes: n_numbers.saturating_mul(size_of::<f64>()), flops }
    }

    /// The price of both.
    pub fn and(self, other: Self) -> Self {
        Self { n_bytes: self.n_bytes.saturating_add(other.n_bytes), flops: self.flops + other.flops }
    }
}

/// A cloud and the queries over it.
#[derive(Debug, Clone, Copy)]
pub struct Sizes {
    pub n_points: usize,
    pub n_queries: usize,
    pub dimension: usize,
}

impl Sizes {
    /// Numbers of value, gradient and Hessian at all queries.
    pub(crate) fn jets(self) -> usize {
        self.n_queries.saturating_mul(1 + self.dimension + self.dimension * self.dimension)
    }

    /// Numbers of points, queries and dimension, for flops.
    pub(crate) fn as_f64(self) -> [f64; 3] {
        [self.n_points as f64, self.n_queries as f64, self.dimension as f64]
    }
}
