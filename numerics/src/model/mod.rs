//! Models: the choice among solvers, and the operations that differ between them.
//!
//! A [`Recipe`] is complete: together with the cloud it determines everything that preparation depends on. A
//! [`Model`] is a recipe made ready. Everything that depends on the solver is in this folder. So a new solver
//! is a variant of both enums and an arm in each method. A method that a solver lacks returns
//! [`NumericsError::Unsupported`].

pub mod choose;
pub mod kind;
mod making;
pub mod price;
mod process;
mod recipe;
mod report;
mod values;

use std::sync::Arc;

use crate::error::{NumericsError, Quantity, Result, SolverKind};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::sampling::Sampling;
use crate::regression::function::interpolant::Interpolant;
use crate::regression::function::local_kriging::LocalKriging;
use crate::regression::solver::trend::Mean;
use crate::regression::solver::{EarlierSolutions, Method, RightHandSide, Solution, Solver};
use crate::surface::Surface;
use crate::surface::local::{LocalInputs, LocalSurface};
use crate::surface::signature::{Signature, SignatureSurface};
pub use making::Making;
pub use process::ScaledProcess;
pub use recipe::Recipe;
pub use report::Report;
pub use values::{EachAt, FittedValues, JetRequest, ValuesAt};

/// A [`Recipe`] made ready to answer.
pub enum Model {
    /// Weights for values from one system over all points.
    System(Arc<Solver>),
    /// A small system, solved around each query.
    LocalKriging(Arc<LocalKriging>),
    /// Nothing to prepare: local regressions are made with their surface.
    LocalSurface,
}

/// Inputs of a surface besides its model.
pub struct SurfaceMaking<'a> {
    pub cloud: &'a Arc<Cloud>,
    pub sampling: Arc<Sampling>,
    pub given: LocalInputs<'a>,
    /// What is known of the weights of the signature function, which interpolates the constant 1.
    pub signature: EarlierSolutions,
}

impl Model {
    pub fn solver_kind(&self) -> SolverKind {
        match self {
            Self::System(solver) => match solver.method() {
                Method::Landmark => SolverKind::Landmark,
                Method::ConjugateGradients => SolverKind::Iterative,
                Method::Cholesky | Method::PivotedCholesky => SolverKind::Dense,
            },
            Self::LocalKriging(_) | Self::LocalSurface => SolverKind::Local,
        }
    }

    /// Bytes held on the heap, including those of the cloud.
    pub fn n_bytes(&self) -> usize {
        match self {
            Self::System(solver) => solver.n_bytes(),
            Self::LocalKriging(moving) => moving.n_bytes(),
            Self::LocalSurface => 0,
        }
    }

    /// Returns the solver that has weights for values at all points.
    ///
    /// # Errors
    /// [`NumericsError::Unsupported`] where the model has no such solver.
    pub fn solver(&self) -> Result<&Arc<Solver>> {
        match self {
            Self::System(solver) => Ok(solver),
            Self::LocalKriging(_) | Self::LocalSurface => Err(self.lacks(Quantity::DenseMatrix)),
        }
    }

    /// Returns the local kriging of this model, which solves a system around each query.
    pub fn kriging(&self) -> Option<&Arc<LocalKriging>> {
        match self {
            Self::LocalKriging(moving) => Some(moving),
            Self::System(_) | Self::LocalSurface => None,
        }
    }

    /// Returns the function with values `[n]`, unit V, at the fitted points.
    ///
    /// `known` holds its weights, or those of other values, if they were solved before.
    ///
    /// # Errors
    /// Returns the errors of [`Interpolant::fit_with_mean`], and [`NumericsError::Unsupported`] where each
    /// query has a function of its own.
    pub fn interpolant(
        &self,
        values: &[f64],
        mean: Mean,
        known: EarlierSolutions,
        observer: &dyn Observer,
    ) -> Result<Interpolant> {
        let solver = self.solver()?.clone();
        let sought = RightHandSide { values, earlier: &known.earlier };
        let solution = match known.these {
            Some(solution) => {
                solver.knows_weights(observer);
                solution
            }
            None => Arc::new(Solution::starting(&solver, sought, mean, observer)?),
        };
        Ok(Interpolant { solver, solution })
    }

    /// Returns the model with another tolerance, which takes no work. `None` unless its solver iterates.
    pub fn with_tolerance(&self, tolerance: f64) -> Option<Self> {
        Some(Self::System(Arc::new(self.solver().ok()?.with_tolerance(tolerance)?)))
    }

    /// Returns the surface that the points sample: a level of the signature function, or local regressions.
    ///
    /// # Errors
    /// Returns the errors of [`SignatureSurface::over`] and [`LocalSurface::of`], and
    /// [`NumericsError::Unsupported`] for local kriging of values.
    pub fn surface(&self, making: SurfaceMaking<'_>, observer: &dyn Observer) -> Result<Surface> {
        let SurfaceMaking { cloud, sampling, given, signature } = making;
        match self {
            Self::LocalSurface => Ok(LocalSurface::of(cloud.clone(), sampling, given, observer)?.into()),
            Self::LocalKriging(_) => Err(self.lacks(Quantity::Geometry)),
            Self::System(solver) => {
                let signature = match signature.these {
                    None => Signature::fit_after(solver.clone(), &signature.earlier, observer)?,
                    Some(solution) => {
                        solver.knows_weights(observer);
                        Signature::of(Interpolant { solver: solver.clone(), solution }, observer)?
                    }
                };
                Ok(SignatureSurface::over(sampling, signature, given.normals, observer)?.into())
            }
        }
    }

    fn lacks(&self, quantity: Quantity) -> NumericsError {
        NumericsError::Unsupported { solver: self.solver_kind(), quantity }
    }
}
