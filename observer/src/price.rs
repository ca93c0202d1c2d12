//! Price of a computation, known before it starts.
//!
//! Flops are counted as those of a large factorization, so that all prices compare.

/// Bytes and flops of a computation; `usize::MAX` bytes where they cannot be counted.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Price {
    pub n_bytes: usize,
    pub flops: f64,
}

impl Price {
    /// The price of `n_numbers` numbers in float64, and of flops.
    pub fn of_numbers(n_numbers: usize, flops: f64) -> Self {
        Self { n_bytes: n_numbers.saturating_mul(size_of::<f64>()), flops }
    }

    /// The sum of two prices.
    pub fn and(self, other: Self) -> Self {
        Self { n_bytes: self.n_bytes.saturating_add(other.n_bytes), flops: self.flops + other.flops }
    }
}
