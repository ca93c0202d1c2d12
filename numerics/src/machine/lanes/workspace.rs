//! Memory for the systems of a batch.

use pulp::Simd;

use super::MAX_LANES;

/// Registers in memory that start at a cache line, so that none straddles two.
pub(crate) struct Workspace {
    numbers: Vec<f64>,
    start: usize,
}

impl Workspace {
    /// Zeros in at least `n_registers` registers of any instruction set.
    pub(crate) fn new(n_registers: usize) -> Self {
        let numbers = vec![0.0; (n_registers + 1) * MAX_LANES];
        let start = numbers.as_ptr().align_offset(64).min(MAX_LANES);
        Self { numbers, start }
    }

    #[inline(always)]
    pub(crate) fn registers<S: Simd>(&mut self) -> &mut [S::f64s] {
        S::as_mut_simd_f64s(&mut self.numbers[self.start..]).0
    }
}
