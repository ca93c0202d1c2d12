//! Objects that requests and answers share.

pub mod kernel;

mod choices;
mod cloud_ref;
mod diagnostics;
mod fit;
mod hyperparameters;
pub mod limits;
pub mod schemas;

pub use choices::{
    DuplicatePolicy, GeometryInclude, MeanChoice, OrientationChoice, SolverChoice, SurfaceModelChoice,
    SurfaceModelUsed, ValuesInclude,
};
pub use cloud_ref::CloudRef;
pub use diagnostics::{
    Diagnostics, FactorizationUsed, Flag, FlagReason, SolverUsed, StencilsUsed, Warning, WarningCode,
};
pub(crate) use fit::request;
pub use fit::{Fit, GivenProcess, HasCloud, Surface};
pub use hyperparameters::{Hyperparameters, MeansLevel, NoiseRatio};
pub use kernel::{Kernel, KernelFamily, KernelUsed};
