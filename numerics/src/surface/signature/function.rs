//! The signature function of a cloud.

use std::sync::Arc;

use crate::error::Result;
use crate::machine::heap::vec_bytes;
use crate::observer::Observer;
use crate::regression::function::interpolant::Interpolant;
use crate::regression::solver::{RightHandSide, Solution, Solver};
use crate::regression::sums::jets::{JetOrder, Jets};
use crate::surface::flags::roundings;

/// The paper's signature function u_X, the fit of the constant 1, with its values and derivatives at the
/// points.
///
/// The surface is the level 1 of u. With α > 0 it is the level that is the mean of u over the cloud. On
/// closed clouds u > 1 inside while ℓ is not small against the features (errata.md, 2 and 13).
pub struct Signature {
    function: Interpolant,
    /// Absent for kernels with a kink at the points.
    at_points: Option<AtPoints>,
}

/// Values and derivatives of u at the points.
struct AtPoints {
    jets: Jets,
    /// True where ∇u is rounding (T1), `[n]`.
    is_rounding: Vec<bool>,
}

impl Signature {
    /// Solves for the weights, and evaluates u in the same pass that finds their residual.
    ///
    /// # Errors
    /// Returns the errors of `Solution::with_jets`.
    pub fn fit(solver: Arc<Solver>, observer: &dyn Observer) -> Result<Self> {
        Self::fit_after(solver, &[], observer)
    }

    /// Computes [`Signature::fit`] from earlier solutions, to other tolerances.
    ///
    /// # Errors
    /// Returns the errors of [`Signature::fit`].
    pub fn fit_after(
        solver: Arc<Solver>,
        earlier: &[Arc<Solution>],
        observer: &dyn Observer,
    ) -> Result<Self> {
        let ones = vec![1.0; solver.n_points()];
        let sought = RightHandSide { values: &ones, earlier };
        let order = (!solver.kernel().has_kink()).then_some(JetOrder::Hessian);
        let (solution, jets) = Solution::with_jets(&solver, sought, order, observer)?;
        Self::with(Interpolant { solver, solution: Arc::new(solution) }, jets, observer)
    }

    /// Builds the signature function from weights that are known.
    ///
    /// # Errors
    /// Returns the errors of [`Interpolant::at`].
    pub fn of(function: Interpolant, observer: &dyn Observer) -> Result<Self> {
        let solver = &function.solver;
        let jets = if solver.kernel().has_kink() {
            None
        } else {
            Some(function.at(solver.cloud(), JetOrder::Hessian, observer)?)
        };
        Self::with(function, jets, observer)
    }

    fn with(function: Interpolant, jets: Option<Jets>, observer: &dyn Observer) -> Result<Self> {
        let at_points = match jets {
            None => None,
            Some(jets) => {
                let is_rounding = roundings(&function, function.solver.cloud(), &jets, observer)?;
                Some(AtPoints { jets, is_rounding })
            }
        };
        Ok(Self { function, at_points })
    }

    /// The function u.
    pub fn function(&self) -> &Interpolant {
        &self.function
    }

    /// Jets u, ∇u and D²u at the points, where they exist.
    pub(crate) fn jets(&self) -> Option<&Jets> {
        self.at_points.as_ref().map(|at_points| &at_points.jets)
    }

    /// Returns whether ∇u at a point is rounding error, and false where there is no ∇u.
    pub(crate) fn is_gradient_rounding_error(&self, point: usize) -> bool {
        self.at_points.as_ref().is_some_and(|at_points| at_points.is_rounding[point])
    }

    /// Bytes held on the heap beside the factor.
    pub(crate) fn n_bytes(&self) -> usize {
        let of = |at_points: &AtPoints| at_points.jets.n_bytes() + vec_bytes(&at_points.is_rounding);
        self.function.solution.n_bytes() + self.at_points.as_ref().map_or(0, of)
    }
}
