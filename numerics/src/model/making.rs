//! From a recipe to a model.

use std::sync::Arc;

use super::{Model, Recipe};
use crate::error::NumericsError;
use crate::function::moving::Moving;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::sampling::Sampling;
use crate::solver::{Solver, System, Workspace};

/// What a model is made from, beside its recipe.
pub struct Making<'a> {
    pub cloud: Arc<Cloud>,
    /// How the cloud is sampled, if that is known.
    pub sampling: Option<Arc<Sampling>>,
    /// The memory of a factorization.
    pub workspace: Workspace<'a>,
}

impl Recipe {
    /// Whether making it looks at the neighbours of points.
    pub fn needs_sampling(&self) -> bool {
        self.is_kriged_locally()
    }

    /// The model, where making it takes no work.
    pub fn made_at_once(&self) -> Option<Model> {
        match self {
            Self::LocalSurface { .. } => Some(Model::LocalSurface),
            Self::System { .. } | Self::LocalKriging { .. } => None,
        }
    }

    /// Makes the model ready.
    ///
    /// # Errors
    /// Those of [`System::new`] and [`Solver::dense_in`]; [`NumericsError::Cancelled`].
    pub fn make(self, making: Making<'_>, observer: &dyn Observer) -> Result<Model, NumericsError> {
        let Making { cloud, sampling, workspace } = making;
        match self {
            Self::System { kernel, regularization } => {
                let system = System::new(cloud, kernel, regularization)?;
                Ok(Model::System(Arc::new(Solver::dense_in(workspace, system, observer)?)))
            }
            Self::LocalKriging { kernel, regularization } => {
                let sampling = match sampling {
                    Some(sampling) => sampling,
                    None => Arc::new(Sampling::of(&cloud, observer)?),
                };
                let system = System::new(cloud, kernel, regularization)?;
                Ok(Model::LocalKriging(Arc::new(Moving::new(system, sampling, observer)?)))
            }
            Self::LocalSurface { .. } => Ok(Model::LocalSurface),
        }
    }
}
