//! Length scales that differ from axis to axis.

use crate::machine::heap::vec_bytes;

/// The length scales ℓ_c, `[d]`, unit L, and the factors by which coordinates are stretched.
#[derive(Debug, PartialEq)]
pub(super) struct Axes {
    length_scales: Vec<f64>,
    /// ℓ/ℓ_c with ℓ the shortest length scale, `[d]`, at most 1.
    factors: Vec<f64>,
}

impl Axes {
    /// Takes length scales that are checked already, and the shortest of them.
    pub(super) fn new(length_scales: &[f64], shortest: f64) -> Self {
        let factors = length_scales.iter().map(|length_scale| shortest / length_scale).collect();
        Self { length_scales: length_scales.to_vec(), factors }
    }

    pub(super) fn length_scales(&self) -> &[f64] {
        &self.length_scales
    }

    pub(super) fn factors(&self) -> &[f64] {
        &self.factors
    }

    /// Bytes held on the heap.
    pub(super) fn n_bytes(&self) -> usize {
        vec_bytes(&self.length_scales) + vec_bytes(&self.factors)
    }
}
