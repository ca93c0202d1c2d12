//! Solvers of `(K + αI) Λ = Y`: systems prepared so that weights for values are cheap.

pub(crate) mod price;
pub mod system;
pub mod trend;

mod condition;
mod dense;
mod factor;
mod factorized;
pub(crate) mod landmark;
mod many;
mod residuals;
mod solution;

use std::sync::Arc;

use super::error::Result;
use super::kernel::Kernel;
use super::machine::pages::SpareBuffer;
use super::observer::Observer;
use super::points::cloud::Cloud;
use super::sums::expansion::Expansion;
use super::sums::regularization::Regularization;
pub(crate) use condition::estimate_norm1;
pub(crate) use dense::{PIVOT_TOLERANCE, factorize_in_place};
pub use factor::{Factor, FactorBuilder};
pub use factorized::{Method, Remaining, Solver, Workspace};
pub(crate) use factorized::{SMALLEST_PIVOT, Whitened};
pub use residuals::{Disagreement, Outlier, Place};
pub(crate) use solution::MAX_RELATIVE_RESIDUAL;
pub use solution::Solution;
pub use system::System;

/// Number of points up to which the diagonal of the inverse is computed. It costs three factorizations.
pub(crate) const MAX_INVERSE_DIAGONAL: usize = 512;

impl Solver {
    /// Factorizes the whole matrix, in memory of its own.
    ///
    /// # Errors
    /// `NumericsError::OutOfMemory`, `NumericsError::Cancelled`.
    pub fn dense(system: System, observer: &dyn Observer) -> Result<Self> {
        let (spare, mut may_take) = (SpareBuffer::up_to(0), |_| true);
        Self::dense_in(Workspace { spare: &spare, may_take: &mut may_take }, system, observer)
    }

    pub fn cloud(&self) -> &Arc<Cloud> {
        self.system().cloud()
    }

    pub fn kernel(&self) -> &Kernel {
        self.system().kernel()
    }

    pub fn regularization(&self) -> &Regularization {
        self.system().regularization()
    }

    pub fn n_points(&self) -> usize {
        self.system().n_points()
    }

    /// Returns the function with given weights, one for each of its centres.
    pub(crate) fn expansion<'a>(&'a self, weights: &'a [f64]) -> Expansion<'a> {
        let (centres, _) = self.centres();
        Expansion { centres, kernel: self.kernel(), weights }
    }

    /// Restricts weights at all points, `[n]`, to weights of the centres, `[r]`.
    fn at_centres(&self, weights: &[f64]) -> Vec<f64> {
        match self.centres() {
            (_, None) => weights.to_vec(),
            (_, Some(points)) => points.iter().map(|&point| weights[point]).collect(),
        }
    }
}

#[cfg(test)]
mod tests;
