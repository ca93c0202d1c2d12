//! Standard deviations of a function and its derivatives.

use std::ops::Range;

use super::COLUMNS_AT_ONCE;
use super::functionals::{JetFunctional, ScaledFit, deviations, has_variance};
use super::interpolant::Interpolant;
use crate::error::{NumericsError, Result};
use crate::observer::Observer;
use crate::points::cloud::Cloud;

/// Posterior standard deviations of a jet at m queries.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JetDeviations {
    /// `[m]`, unit V.
    pub values: Vec<f64>,
    /// `[m, d]`, unit V/L; empty unless asked for.
    pub gradients: Vec<f64>,
    /// `[m, d, d]`, unit V/L²; empty unless asked for.
    pub hessians: Vec<f64>,
    /// Queries, ascending, where rounding made a variance negative. Its deviation is 0.
    pub clamped: Vec<usize>,
}

impl JetDeviations {
    /// Computes the deviations of the value and of derivatives up to `order`, 0 to 2.
    ///
    /// Kernel and noise are `factor` times those of the solver.
    ///
    /// # Errors
    /// - [`NumericsError::DerivativesVary`] if the process has no such derivatives: their variance is
    ///   infinite.
    /// - [`NumericsError::NotPositiveDefinite`] without a Cholesky factor.
    /// - [`NumericsError::DimensionMismatch`], [`NumericsError::KernelNotSmooth`],
    ///   [`NumericsError::Overflow`], [`NumericsError::Cancelled`].
    pub fn of(
        interpolant: &Interpolant,
        factor: f64,
        queries: &Cloud,
        order: usize,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let fit = ScaledFit { solver: &interpolant.solver, solution: &interpolant.solution, factor };
        if !has_variance(fit.solver.kernel(), order) {
            return Err(NumericsError::DerivativesVary { order });
        }
        let (m, d) = (queries.n_points(), queries.dimension());
        let width = width(d, order);
        let per_block = (COLUMNS_AT_ONCE / width).max(1);
        let (mut all, mut clamped) = (Vec::with_capacity(m * width), Vec::new());
        for first in (0..m).step_by(per_block) {
            let functionals = functionals(first..(first + per_block).min(m), d, order);
            let found = deviations(fit, queries, &functionals, observer)?;
            clamped.extend(found.clamped.iter().map(|at| functionals[*at].query));
            all.extend(found.found);
        }
        clamped.dedup();
        Ok(Self { clamped, ..Self::of_packed(&all, d, order) })
    }

    /// Unpacks deviations in the order of [`functionals`], each query in [`width`] numbers.
    pub(super) fn of_packed(found: &[f64], d: usize, order: usize) -> Self {
        let mut of = Self::default();
        for jet in found.chunks_exact(width(d, order)) {
            let (value, rest) = jet.split_at(1);
            of.values.extend(value);
            let (gradient, hessian) = rest.split_at(if order >= 1 { d } else { 0 });
            of.gradients.extend(gradient);
            if order >= 2 {
                of.hessians.extend((0..d * d).map(|at| hessian[upper(at / d, at % d, d)]));
            }
        }
        of
    }

    /// Returns the deviations for a kernel and noise that are `factor` times as large.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        let root = factor.sqrt();
        for list in [&mut self.values, &mut self.gradients, &mut self.hessians] {
            list.iter_mut().for_each(|deviation| *deviation *= root);
        }
        self
    }
}

/// Functionals per query: the value, the d first derivatives, and the upper triangle of the Hessian.
///
/// Lower orders end earlier.
fn width(d: usize, order: usize) -> usize {
    [1, 1 + d, 1 + d + d * (d + 1) / 2][order.min(2)]
}

/// Returns the functionals of each query: value, first derivatives, upper triangle of the Hessian.
///
/// The triangle is read row by row. Lower orders end earlier.
fn functionals(queries: Range<usize>, d: usize, order: usize) -> Vec<JetFunctional> {
    let mut functionals = Vec::with_capacity(queries.len() * width(d, order));
    for query in queries {
        functionals.push(JetFunctional::value(query, d));
        if order >= 1 {
            functionals.extend((0..d).map(|axis| {
                let mut along = vec![0.0; d];
                along[axis] = 1.0;
                JetFunctional::derivative(query, &along)
            }));
        }
        if order >= 2 {
            let pairs = (0..d).flat_map(|a| (a..d).map(move |b| (a, b)));
            functionals.extend(pairs.map(|(a, b)| JetFunctional::second_derivative(query, d, a, b)));
        }
    }
    functionals
}

/// Returns the index of entry (a, b) of a symmetric matrix in its upper triangle, stored row by row.
fn upper(a: usize, b: usize, d: usize) -> usize {
    let (row, column) = (a.min(b), a.max(b));
    row * d - row * (row + 1) / 2 + column
}
