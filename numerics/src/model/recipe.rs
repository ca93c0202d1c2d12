//! Recipe of a model: a solver, with everything that its preparation depends on besides the cloud.

use std::sync::Arc;

use crate::error::{NumericsError, SolverKind};
use crate::kernel::Kernel;
use crate::points::cloud::Cloud;
use crate::regression::solver::{DEFAULT_TOLERANCE, System};
use crate::regression::sums::regularization::Regularization;
use crate::surface::local::Learning;

/// Choice of a solver and its parameters. Equal recipes over equal clouds give equal models.
#[derive(Debug, Clone, PartialEq)]
pub enum Recipe {
    /// A single system over all points, factorized.
    System { kernel: Kernel, regularization: Regularization },
    /// A single system over all points, solved on landmarks.
    Landmark { kernel: Kernel, regularization: Regularization },
    /// A single system over all points, solved by conjugate gradients until the relative residual is at most
    /// `tolerance`.
    Iterative { kernel: Kernel, regularization: Regularization, tolerance: f64 },
    /// A small system around each query, from its nearest points.
    LocalKriging { kernel: Kernel, regularization: Regularization },
    /// A surface by local regressions, which choose kernel and noise by themselves. They learn all over the
    /// cloud, unless `learning` says otherwise.
    LocalSurface { learning: Option<Learning> },
}

impl Recipe {
    /// Returns the recipe by which a solver serves values or a signature function.
    pub fn of_values(solver: SolverKind, kernel: Kernel, regularization: Regularization) -> Self {
        match solver {
            SolverKind::Dense => Self::System { kernel, regularization },
            SolverKind::Landmark => Self::Landmark { kernel, regularization },
            SolverKind::Iterative => Self::Iterative { kernel, regularization, tolerance: DEFAULT_TOLERANCE },
            SolverKind::Local => Self::LocalKriging { kernel, regularization },
        }
    }

    /// Returns the recipe with another tolerance, if its solver iterates.
    pub fn with_tolerance(self, tolerance: f64) -> Self {
        match self {
            Self::Iterative { kernel, regularization, .. } => {
                Self::Iterative { kernel, regularization, tolerance }
            }
            other => other,
        }
    }

    /// Returns the tolerance, if the solver iterates.
    pub fn tolerance(&self) -> Option<f64> {
        match self {
            Self::Iterative { tolerance, .. } => Some(*tolerance),
            Self::System { .. }
            | Self::Landmark { .. }
            | Self::LocalKriging { .. }
            | Self::LocalSurface { .. } => None,
        }
    }

    pub fn solver(&self) -> SolverKind {
        match self {
            Self::System { .. } => SolverKind::Dense,
            Self::Landmark { .. } => SolverKind::Landmark,
            Self::Iterative { .. } => SolverKind::Iterative,
            Self::LocalKriging { .. } | Self::LocalSurface { .. } => SolverKind::Local,
        }
    }

    /// Returns kernel and regularization, or `None` where they follow from the points.
    pub fn process(&self) -> Option<(&Kernel, &Regularization)> {
        match self {
            Self::System { kernel, regularization }
            | Self::Landmark { kernel, regularization }
            | Self::Iterative { kernel, regularization, .. }
            | Self::LocalKriging { kernel, regularization } => Some((kernel, regularization)),
            Self::LocalSurface { .. } => None,
        }
    }

    /// Returns where local regressions have their hyperparameters from, if that is given.
    pub fn learning(&self) -> Option<&Learning> {
        match self {
            Self::LocalSurface { learning } => learning.as_ref(),
            Self::System { .. }
            | Self::Landmark { .. }
            | Self::Iterative { .. }
            | Self::LocalKriging { .. } => None,
        }
    }

    /// Returns whether values are used a neighbourhood at a time, never all at once.
    pub fn is_kriged_locally(&self) -> bool {
        matches!(self, Self::LocalKriging { .. })
    }

    /// Returns the system over a cloud whose factor can be stored and read again, or `None` if nothing is
    /// factorized.
    ///
    /// # Errors
    /// Returns the errors of [`System::new`].
    pub fn factorized_system(&self, cloud: &Arc<Cloud>) -> Result<Option<System>, NumericsError> {
        match self {
            Self::System { kernel, regularization } => {
                System::new(cloud.clone(), kernel.clone(), regularization.clone()).map(Some)
            }
            Self::Landmark { .. }
            | Self::Iterative { .. }
            | Self::LocalKriging { .. }
            | Self::LocalSurface { .. } => Ok(None),
        }
    }
}
