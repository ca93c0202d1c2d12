//! How a fit is served: one choice among the solvers, and the verbs that differ between them.
//!
//! A [`Recipe`] is complete: with the cloud it names everything that preparation depends on. A [`Model`] is the recipe made
//! ready. All that depends on which solver it is stands in this folder, so a new solver is a variant of both enums, and an arm in
//! each verb. A verb that a solver lacks refuses with [`NumericsError::Unsupported`].

pub mod choose;
mod making;
pub mod price;
mod process;
mod recipe;
mod report;
mod values;

use std::sync::Arc;

use crate::error::{NumericsError, Quantity, SolverKind};
use crate::function::interpolant::Interpolant;
use crate::function::moving::Moving;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::sampling::Sampling;
use crate::solver::trend::Mean;
use crate::solver::{Solution, Solver};
use crate::surface::Surface;
use crate::surface::local::{Given, LocalSurface};
use crate::surface::signature::{Signature, SignatureSurface};
pub use making::Making;
pub use process::ScaledProcess;
pub use recipe::Recipe;
pub use report::{Regressions, Report};
pub use values::{EachAt, FittedValues, JetRequest, ValuesAt};

/// A [`Recipe`] made ready.
pub enum Model {
    /// Weights for values from one system over all points.
    System(Arc<Solver>),
    /// A small system around each query.
    LocalKriging(Arc<Moving>),
    /// Nothing: local regressions are made with their surface.
    LocalSurface,
}

/// What a surface is made from, beside its model.
pub struct SurfaceMaking<'a> {
    pub cloud: &'a Arc<Cloud>,
    pub sampling: Arc<Sampling>,
    pub given: Given<'a>,
    /// The weights of the constant 1, if they are known.
    pub signature: Option<Arc<Solution>>,
}

impl Model {
    pub fn solver_kind(&self) -> SolverKind {
        match self {
            Self::System(_) => SolverKind::Dense,
            Self::LocalKriging(_) | Self::LocalSurface => SolverKind::Local,
        }
    }

    /// The label of the model in metrics: a factorization of all of the matrix or of its pivots, neighbourhoods, or nothing.
    pub fn name(&self) -> &'static str {
        match self {
            Self::System(solver) if solver.rank() < solver.n_points() => "pivoted",
            Self::System(_) => "dense",
            Self::LocalKriging(_) => "moving",
            Self::LocalSurface => "local",
        }
    }

    /// Bytes held on the heap, those of the cloud included.
    pub fn n_bytes(&self) -> usize {
        match self {
            Self::System(solver) => solver.n_bytes(),
            Self::LocalKriging(moving) => moving.n_bytes(),
            Self::LocalSurface => 0,
        }
    }

    /// The solver that has weights for values at all points.
    ///
    /// # Errors
    /// [`NumericsError::Unsupported`] where there is none.
    pub fn solver(&self) -> Result<&Arc<Solver>, NumericsError> {
        match self {
            Self::System(solver) => Ok(solver),
            Self::LocalKriging(_) | Self::LocalSurface => Err(self.lacks(Quantity::DenseMatrix)),
        }
    }

    /// The system that is solved around each query.
    pub fn kriging(&self) -> Option<&Arc<Moving>> {
        match self {
            Self::LocalKriging(moving) => Some(moving),
            Self::System(_) | Self::LocalSurface => None,
        }
    }

    /// The function with values `[n]`, unit V, at the fitted points; `known` are its weights, if they were solved before.
    ///
    /// # Errors
    /// Those of [`Interpolant::fit_with_mean`]; [`NumericsError::Unsupported`] where each query has a function of its own.
    pub fn interpolant(
        &self,
        values: &[f64],
        mean: Mean,
        known: Option<Arc<Solution>>,
        observer: &dyn Observer,
    ) -> Result<Interpolant, NumericsError> {
        let solver = self.solver()?.clone();
        match known {
            Some(solution) => Ok(Interpolant { solver, solution }),
            None => Interpolant::fit_with_mean(solver, values, mean, observer),
        }
    }

    /// The surface that the points sample: the level of the signature function, or local regressions.
    ///
    /// # Errors
    /// Those of [`SignatureSurface::over`] and [`LocalSurface::of`]; [`NumericsError::Unsupported`] for local kriging of values.
    pub fn surface(
        &self,
        making: SurfaceMaking<'_>,
        observer: &dyn Observer,
    ) -> Result<Surface, NumericsError> {
        let SurfaceMaking { cloud, sampling, given, signature } = making;
        match self {
            Self::LocalSurface => Ok(LocalSurface::of(cloud.clone(), sampling, given, observer)?.into()),
            Self::LocalKriging(_) => Err(self.lacks(Quantity::Geometry)),
            Self::System(solver) => {
                let signature = match signature {
                    None => Signature::fit(solver.clone(), observer)?,
                    Some(solution) => {
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
