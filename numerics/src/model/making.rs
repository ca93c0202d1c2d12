//! Preparation of a model from its recipe.

use std::sync::Arc;

use super::{Model, Recipe};
use crate::error::Result;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::sampling::Sampling;
use crate::regression::function::local_kriging::LocalKriging;
use crate::regression::solver::{Solver, System, Workspace};

/// Inputs of a model besides its recipe.
pub struct Making<'a> {
    pub cloud: Arc<Cloud>,
    /// Sampling of the cloud, if it is known.
    pub sampling: Option<Arc<Sampling>>,
    /// Memory for a factorization.
    pub workspace: Workspace<'a>,
}

impl Recipe {
    /// Returns whether making the model needs the neighbours of points.
    pub fn needs_sampling(&self) -> bool {
        self.is_kriged_locally()
    }

    /// Returns the model if making it takes no work.
    pub fn made_at_once(&self) -> Option<Model> {
        match self {
            Self::LocalSurface { .. } => Some(Model::LocalSurface),
            Self::System { .. }
            | Self::Landmark { .. }
            | Self::Iterative { .. }
            | Self::LocalKriging { .. } => None,
        }
    }

    /// Makes the model ready.
    ///
    /// # Errors
    /// Returns the errors of [`System::new`], [`Solver::dense_in`], [`Solver::landmark`] and
    /// [`Solver::iterative_to`], and `NumericsError::Cancelled`.
    pub fn make(self, making: Making<'_>, observer: &dyn Observer) -> Result<Model> {
        let Making { cloud, sampling, workspace } = making;
        match self {
            Self::System { kernel, regularization } => {
                let system = System::new(cloud, kernel, regularization)?;
                Ok(Model::System(Arc::new(Solver::dense_in(workspace, system, observer)?)))
            }
            Self::Landmark { kernel, regularization } => {
                let system = System::new(cloud, kernel, regularization)?;
                Ok(Model::System(Arc::new(Solver::landmark(system, observer)?)))
            }
            Self::Iterative { kernel, regularization, tolerance } => {
                let system = System::new(cloud, kernel, regularization)?;
                Ok(Model::System(Arc::new(Solver::iterative_to(tolerance, system, observer)?)))
            }
            Self::LocalKriging { kernel, regularization } => {
                let sampling = match sampling {
                    Some(sampling) => sampling,
                    None => Arc::new(Sampling::of(&cloud, observer)?),
                };
                let system = System::new(cloud, kernel, regularization)?;
                Ok(Model::LocalKriging(Arc::new(LocalKriging::new(system, sampling, observer)?)))
            }
            Self::LocalSurface { .. } => Ok(Model::LocalSurface),
        }
    }
}
