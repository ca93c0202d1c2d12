//! How a surface answers at a query: the function whose level surface it is.

use std::sync::Arc;

use crate::numerics::error::NumericsError;
use crate::numerics::function::interpolant::Interpolant;
use crate::numerics::observer::Observer;
use crate::numerics::solver::{Solution, Solver};
use crate::numerics::sums::jets::{JetOrder, Jets};

/// What answers at a query.
pub enum Level {
    /// One global function.
    Signature(Signature),
}

/// The paper's signature function u_X, the fit of the constant 1, with its values and derivatives at the points.
///
/// Its level 1 is the surface (with α > 0, the level that is the mean of u over the cloud). On closed clouds u > 1 inside
/// while ℓ is not small against the features (errata.md, 2 and 13).
pub struct Signature {
    function: Interpolant,
    /// Absent for kernels with a kink at the points.
    jets: Option<Jets>,
}

impl Signature {
    /// Solves for the weights, and evaluates in the same pass that finds their residual.
    ///
    /// # Errors
    /// Those of [`Solution::with_jets`].
    pub fn fit(solver: Arc<Solver>, observer: &dyn Observer) -> Result<Self, NumericsError> {
        let has_kink = solver.kernel().has_kink();
        let order = if has_kink { JetOrder::Value } else { JetOrder::HessianWithMagnitudes };
        let (solution, jets) = Solution::with_jets(&solver, &vec![1.0; solver.n_points()], order, observer)?;
        let function = Interpolant { solver, solution: Arc::new(solution) };
        Ok(Self { function, jets: (!has_kink).then_some(jets) })
    }

    /// The same of weights that are known.
    ///
    /// # Errors
    /// Those of [`Interpolant::at`].
    pub fn of(function: Interpolant, observer: &dyn Observer) -> Result<Self, NumericsError> {
        let solver = &function.solver;
        let jets = match solver.kernel().has_kink() {
            true => None,
            false => Some(function.at(solver.cloud(), JetOrder::HessianWithMagnitudes, observer)?),
        };
        Ok(Self { function, jets })
    }

    /// u.
    pub fn function(&self) -> &Interpolant {
        &self.function
    }

    /// u, ∇u and D²u at the points, where they exist.
    pub(crate) fn jets(&self) -> Option<&Jets> {
        self.jets.as_ref()
    }

    /// Bytes held on the heap beside the factor.
    pub(crate) fn n_bytes(&self) -> usize {
        self.function.solution.n_bytes() + self.jets.as_ref().map_or(0, Jets::n_bytes)
    }
}
