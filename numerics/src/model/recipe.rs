//! A choice of solver, with everything that its preparation depends on beside the cloud.

use std::sync::Arc;

use crate::error::{NumericsError, SolverKind};
use crate::kernel::Kernel;
use crate::points::cloud::Cloud;
use crate::solver::System;
use crate::sums::regularization::Regularization;

/// How a fit is served. Equal recipes over equal clouds give equal models.
#[derive(Debug, Clone, PartialEq)]
pub enum Recipe {
    /// One system over all points, factorized.
    System { kernel: Kernel, regularization: Regularization },
    /// A small system around each query, from its nearest points.
    LocalKriging { kernel: Kernel, regularization: Regularization },
    /// A surface by local regressions, which choose kernel and noise by themselves: at sites, if these are given.
    LocalSurface { sites: Option<Arc<Cloud>> },
}

impl Recipe {
    /// The recipe of values, or of a signature function, by a solver.
    pub fn of_values(solver: SolverKind, kernel: Kernel, regularization: Regularization) -> Self {
        match solver {
            SolverKind::Dense => Self::System { kernel, regularization },
            SolverKind::Local => Self::LocalKriging { kernel, regularization },
        }
    }

    pub fn solver(&self) -> SolverKind {
        match self {
            Self::System { .. } => SolverKind::Dense,
            Self::LocalKriging { .. } | Self::LocalSurface { .. } => SolverKind::Local,
        }
    }

    /// Kernel and regularization, unless they follow from the points.
    pub fn process(&self) -> Option<(&Kernel, &Regularization)> {
        match self {
            Self::System { kernel, regularization } | Self::LocalKriging { kernel, regularization } => {
                Some((kernel, regularization))
            }
            Self::LocalSurface { .. } => None,
        }
    }

    /// Where local regressions learn, if that is given.
    pub fn sites(&self) -> Option<&Cloud> {
        match self {
            Self::LocalSurface { sites } => sites.as_deref(),
            Self::System { .. } | Self::LocalKriging { .. } => None,
        }
    }

    /// Whether values are seen a neighbourhood at a time, never all at once.
    pub fn is_kriged_locally(&self) -> bool {
        matches!(self, Self::LocalKriging { .. })
    }

    /// The system over a cloud whose factor can be kept and read again; `None` where nothing is factorized.
    ///
    /// # Errors
    /// Those of [`System::new`].
    pub fn factorized_system(&self, cloud: &Arc<Cloud>) -> Result<Option<System>, NumericsError> {
        match self {
            Self::System { kernel, regularization } => {
                System::new(cloud.clone(), kernel.clone(), regularization.clone()).map(Some)
            }
            Self::LocalKriging { .. } | Self::LocalSurface { .. } => Ok(None),
        }
    }
}
