//! Price of a computation, known before it starts.
//!
//! Flops are counted as those of a large factorization, so that all prices compare. A sum over pairs takes
//! longer for each operation, so its flops count for more. Each module keeps the prices of its computations
//! in a file `price.rs`, or beside the function.

pub use gramian_observer::Price;

/// Sizes of a cloud and of the queries over it.
#[derive(Debug, Clone, Copy)]
pub struct Sizes {
    pub n_points: usize,
    pub n_queries: usize,
    pub dimension: usize,
}

impl Sizes {
    /// Count of the numbers in value, gradient and Hessian at all queries.
    pub(crate) fn jets(self) -> usize {
        self.n_queries.saturating_mul(1 + self.dimension + self.dimension * self.dimension)
    }

    /// Number of points, number of queries and dimension as floats, for flops.
    pub(crate) fn as_f64(self) -> [f64; 3] {
        [self.n_points as f64, self.n_queries as f64, self.dimension as f64]
    }
}
