//! A function on space: the kernel expansion whose weights solve the fit of some values.

use std::sync::Arc;

use crate::numerics::error::NumericsError;
use crate::numerics::observer::{Observer, Stage};
use crate::numerics::points::cloud::Cloud;
use crate::numerics::solver::{GramFactor, Solution};
use crate::numerics::sums::jets::{JetOrder, Jets, check_smooth_at};

/// `u(x) = Σ_j λ_j k(x, x_j)`: interpolates the values at α = 0, regresses them at α > 0.
#[derive(Clone)]
pub struct Interpolant {
    pub factor: Arc<GramFactor>,
    pub solution: Arc<Solution>,
}

impl Interpolant {
    /// Fits values `[n]`, unit V.
    ///
    /// # Errors
    /// Those of [`Solution::of`].
    pub fn fit(
        factor: Arc<GramFactor>,
        values: &[f64],
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        let solution = Arc::new(Solution::of(&factor, values, observer)?);
        Ok(Self { factor, solution })
    }

    /// Fits the constant 1: the paper's signature function u_X, whose level 1 is the surface (with α > 0, the level that is
    /// the mean of u over the cloud). On closed clouds u > 1 inside while ℓ is not small against the features
    /// (errata.md, 2 and 13).
    ///
    /// # Errors
    /// Those of [`Solution::of`].
    pub fn signature(factor: Arc<GramFactor>, observer: &dyn Observer) -> Result<Self, NumericsError> {
        let ones = vec![1.0; factor.n_points()];
        Self::fit(factor, &ones, observer)
    }

    /// Evaluates at queries `[m, d]`.
    ///
    /// # Errors
    /// [`NumericsError::DimensionMismatch`]; [`NumericsError::KernelNotSmooth`] if derivatives are asked of a kernel with a
    /// kink at a point of the cloud; [`NumericsError::Overflow`]; [`NumericsError::Cancelled`].
    pub fn at(
        &self,
        queries: &Cloud,
        order: JetOrder,
        observer: &dyn Observer,
    ) -> Result<Jets, NumericsError> {
        let (cloud, kernel) = (self.factor.cloud(), self.factor.kernel());
        cloud.check_same_dimension(queries)?;
        if order != JetOrder::Value {
            check_smooth_at(cloud, kernel, queries)?;
        }
        observer.enter(Stage::Evaluate);
        Jets::evaluate(cloud, kernel, &self.solution.weights, queries, order, observer)
    }
}
