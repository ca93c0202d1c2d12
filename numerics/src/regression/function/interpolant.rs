//! Functions on space: expansions whose weights solve the fit of some values.

use std::sync::Arc;

use crate::error::Result;
use crate::observer::{Observer, Stage};
use crate::points::cloud::Cloud;
use crate::regression::solver::trend::Mean;
use crate::regression::solver::{Solution, Solver};
use crate::regression::sums::jets::{JetOrder, Jets, check_smooth_at};

/// A fitted function `u(x) = m(x) + Σ_j λ_j k(x, z_j)`: z_j are its solver's centres, m is its mean, if any.
///
/// It interpolates the values at α = 0 and regresses them at α > 0.
#[derive(Clone)]
pub struct Interpolant {
    pub solver: Arc<Solver>,
    pub solution: Arc<Solution>,
}

impl Interpolant {
    /// Fits a function without a mean to values `[n]`, unit V.
    ///
    /// # Errors
    /// Returns the errors of [`Solution::of`].
    pub fn fit(solver: Arc<Solver>, values: &[f64], observer: &dyn Observer) -> Result<Self> {
        let solution = Arc::new(Solution::of(&solver, values, observer)?);
        Ok(Self { solver, solution })
    }

    /// Fits a function with a mean to values `[n]`, unit V.
    ///
    /// # Errors
    /// Returns the errors of [`Solution::with_mean`].
    pub fn fit_with_mean(
        solver: Arc<Solver>,
        values: &[f64],
        mean: Mean,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let solution = Arc::new(Solution::with_mean(&solver, values, mean, observer)?);
        Ok(Self { solver, solution })
    }

    /// Fits the constant 1, which gives the paper's signature function u_X.
    ///
    /// Its level 1 is the surface. With α > 0 the surface is the level equal to the mean of u over the cloud.
    /// On closed clouds, u > 1 inside as long as ℓ is not small against the features (errata.md, 2 and 13).
    ///
    /// # Errors
    /// Returns the errors of [`Solution::of`].
    pub fn signature(solver: Arc<Solver>, observer: &dyn Observer) -> Result<Self> {
        let ones = vec![1.0; solver.n_points()];
        Self::fit(solver, &ones, observer)
    }

    /// Evaluates the function and its derivatives up to `order` at queries `[m, d]`.
    ///
    /// # Errors
    /// - `NumericsError::DimensionMismatch`.
    /// - `NumericsError::KernelNotSmooth` if derivatives are requested at a point of the cloud and the
    ///   kernel has a kink there.
    /// - `NumericsError::Overflow`, `NumericsError::Cancelled`.
    pub fn at(&self, queries: &Cloud, order: JetOrder, observer: &dyn Observer) -> Result<Jets> {
        let (cloud, kernel) = (self.solver.cloud(), self.solver.kernel());
        cloud.check_same_dimension(queries)?;
        if order != JetOrder::Value {
            check_smooth_at(cloud, kernel, queries, observer)?;
        }
        observer.enter(Stage::Evaluate);
        let jets = self.solver.expansion(&self.solution.weights).at(queries, order, observer)?;
        Ok(match &self.solution.trend {
            None => jets,
            Some(trend) => jets.plus_linear(queries, &trend.gradient(), |x| trend.at(x)),
        })
    }
}
