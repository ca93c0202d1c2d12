//! Solvers of `(K + αI) Λ = Y`: systems prepared so that weights for values are cheap.

pub(crate) mod price;
pub mod system;
pub mod trend;

mod condition;
mod conjugate_gradients;
mod dense;
mod factor;
mod factorized;
pub(crate) mod iterative;
pub(crate) mod landmark;
mod solution;
mod whitening;

use std::ops::RangeInclusive;
use std::sync::Arc;

use crate::error::Result;
use crate::kernel::Kernel;
use crate::machine::pages::SpareBuffer;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::regression::sums::expansion::Expansion;
use crate::regression::sums::regularization::Regularization;
pub(crate) use condition::estimate_norm1;
pub(crate) use dense::{PIVOT_TOLERANCE, factorize_in_place};
pub use factor::{Factor, FactorBuilder};
pub(crate) use factorized::SMALLEST_PIVOT;
pub use factorized::{Method, Remaining, Solver, Workspace};
pub use landmark::{expected_landmarks, probe_price};
pub(crate) use solution::MAX_RELATIVE_RESIDUAL;
pub use solution::{
    Autocorrelation, Disagreement, EarlierSolutions, Outlier, Place, RightHandSide, Solution,
};
pub use system::System;
pub(crate) use whitening::WhitenedColumns;

/// Largest relative residual of an answer by conjugate gradients, unless a request has another.
pub const DEFAULT_TOLERANCE: f64 = 1e-8;

/// Range of tolerances: rounding below it, and no honest answer above.
pub const TOLERANCES: RangeInclusive<f64> = 1e-14..=MAX_RELATIVE_RESIDUAL;

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

    /// Tells the observer that weights were known, where solving for them is much of the price of a function.
    pub(crate) fn knows_weights(&self, observer: &dyn Observer) {
        if self.landmarks().is_some() || self.iterative().is_some() {
            observer.ended_early();
        }
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

    /// Returns the function with given weights, one for each point, or one for each of the few centres of a
    /// solver that has some.
    pub(crate) fn expansion<'a>(&'a self, weights: &'a [f64]) -> Expansion<'a> {
        let (centres, _) = self.centres();
        // Only landmarks have weights of both kinds. A fallback of full rank has them in the order of its
        // pivots.
        let is_of_all = self.method() == Method::Landmark && weights.len() == self.n_points();
        let centres = if is_of_all { self.cloud() } else { centres };
        Expansion { centres, kernel: self.kernel(), weights }
    }

    /// Restricts weights at all points, `[n]`, to weights of the centres, `[r]`, where the others are 0.
    fn at_centres(&self, weights: &[f64]) -> Vec<f64> {
        match self.method() {
            Method::PivotedCholesky => match self.centres() {
                (_, None) => weights.to_vec(),
                (_, Some(points)) => points.iter().map(|&point| weights[point]).collect(),
            },
            Method::Cholesky | Method::Landmark | Method::ConjugateGradients => weights.to_vec(),
        }
    }
}

#[cfg(test)]
mod tests;
