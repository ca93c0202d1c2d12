//! Objects that requests and answers share.

pub mod kernel;

mod choices;
mod cloud_input;
mod diagnostics;
mod fit;
mod hyperparameters;
pub mod limits;
pub mod schemas;

pub use choices::{
    DuplicatePolicy, GeometryAttribute, MeanChoice, OrientationChoice, SolverChoice, SurfaceModelChoice,
    SurfaceModelUsed, ValueAttribute,
};
pub use cloud_input::CloudInput;
pub use diagnostics::{
    Diagnostics, FactorizationUsed, Flag, FlagReason, SolverUsed, StencilCounts, Warning, WarningCode,
};
pub(crate) use fit::request;
pub use fit::{Fit, GivenProcess, HasCloud, Surface};
pub use hyperparameters::{Hyperparameters, MeansLevel, NoiseRatio};
pub use kernel::{Kernel, KernelFamily, KernelUsed};
