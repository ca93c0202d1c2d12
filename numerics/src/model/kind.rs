//! Kinds of models, as metrics count them.

use strum::{IntoStaticStr, VariantArray};

use super::Model;
use crate::regression::solver::Method;

/// A kind of [`Model`]. Its name is that of its solver: both local kinds have the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "snake_case")]
pub enum ModelKind {
    /// A factorization of the whole matrix.
    Dense,
    /// The fallback of the dense solver: a factorization of the pivots.
    Pivoted,
    /// Weights at landmarks.
    Landmark,
    /// Conjugate gradients.
    Iterative,
    /// Local kriging of values.
    #[strum(serialize = "local")]
    LocalValues,
    /// Local regressions of a surface.
    #[strum(serialize = "local")]
    LocalSurface,
}

/// The purposes of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Serves {
    Values,
    Surface,
    Both,
}

impl ModelKind {
    /// A system of all points serves values and the signature function of a surface.
    pub const fn serves(self) -> Serves {
        match self {
            Self::Dense | Self::Pivoted | Self::Landmark | Self::Iterative => Serves::Both,
            Self::LocalValues => Serves::Values,
            Self::LocalSurface => Serves::Surface,
        }
    }
}

impl Model {
    pub fn kind(&self) -> ModelKind {
        match self {
            Self::System(solver) => match solver.method() {
                Method::Cholesky => ModelKind::Dense,
                Method::PivotedCholesky => ModelKind::Pivoted,
                Method::Landmark => ModelKind::Landmark,
                Method::ConjugateGradients => ModelKind::Iterative,
            },
            Self::LocalKriging(_) => ModelKind::LocalValues,
            Self::LocalSurface => ModelKind::LocalSurface,
        }
    }
}
