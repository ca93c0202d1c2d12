//! Fits of a request, as far as the request defines them, before anything is computed.

mod fits;
mod resolved;
mod surface;
mod values;

use std::sync::Arc;

use crate::http::fields::DuplicatePolicy;
use crate::http::problem::{Pointers, Problem};
use crate::store::clouds::RegisteredCloud;
pub use fits::{FitPlans, PlannedFits};
use gramian_host::memory::Owner;
use gramian_numerics::machine::price::Price;
use gramian_numerics::model::choose::AutoReason;
use gramian_numerics::observer::Observer;
use gramian_numerics::points::sampling::Scales;
pub use resolved::FitPlan;
pub use surface::{PlannedSurface, SurfaceSource};
pub use values::{PlannedValues, Values};

/// A cloud that is fitted for an owner, with the pointers to it in the request.
#[derive(Clone)]
pub struct FittedCloud {
    pub owner: Owner,
    pub stored: Arc<RegisteredCloud>,
    pub pointers: Pointers,
    pub duplicates: DuplicatePolicy,
    /// Largest relative residual of a solver that iterates.
    pub tolerance: f64,
}

/// A fit that is checked as far as the request goes. What the request leaves out follows from the cloud or
/// the values.
pub enum PlannedFit {
    Values(PlannedValues),
    Surface(PlannedSurface),
}

/// Knowledge that a fit still needs before it can be resolved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lack {
    /// Length scales of the cloud.
    Scales,
    /// Noise of the points of the cloud.
    Noise,
    /// Kernel, noise or mean of the values.
    Learned,
}

impl PlannedFit {
    pub fn on(&self) -> &FittedCloud {
        match self {
            Self::Values(fit) => &fit.on,
            Self::Surface(fit) => &fit.on,
        }
    }

    pub fn lack(&self) -> Option<Lack> {
        match self {
            Self::Values(fit) => fit.lack(),
            Self::Surface(fit) => fit.lack(),
        }
    }

    /// Completes the fit, once nothing is lacking.
    ///
    /// # Errors
    /// Returns a [`Problem`] with a pointer to the field.
    pub fn resolve(self, observer: &dyn Observer) -> Result<FitPlan, Problem> {
        match self {
            Self::Values(fit) => fit.resolve(observer),
            Self::Surface(fit) => fit.resolve(observer),
        }
    }
}

impl From<PlannedValues> for PlannedFit {
    fn from(fit: PlannedValues) -> Self {
        Self::Values(fit)
    }
}

impl From<PlannedSurface> for PlannedFit {
    fn from(fit: PlannedSurface) -> Self {
        Self::Surface(fit)
    }
}

impl FittedCloud {
    /// Largest number of points that are factorized. Merging duplicates may leave fewer.
    pub fn n_points(&self) -> usize {
        self.stored.cloud.n_points()
    }

    /// Length scales of the cloud. A fit is resolved only once they are known.
    fn scales(&self) -> Result<&Scales, Problem> {
        self.stored.scales().ok_or_else(Problem::internal)
    }
}

/// Returns the reason for an automatic choice of a solver, as worded in diagnostics.
pub fn words(reason: AutoReason) -> &'static str {
    match reason {
        AutoReason::BeyondDense => "the cloud has more points than a dense factorization may have",
        AutoReason::ManyPoints => "local regressions take time linear in the points, and this cloud is large",
        AutoReason::Deviations => "standard deviations come from local regressions",
        AutoReason::EdgeNormals => "the normals of both sides of an edge come from local regressions",
        AutoReason::FewLandmarks => "few landmarks span the kernels of all points",
        AutoReason::Tolerance => {
            "the cloud has more points than a dense factorization may have, and the request names a tolerance"
        }
        AutoReason::FineCurve => "the level set of a finely sampled curve comes from local regressions",
        AutoReason::Mesh => "the mesh of a surface comes from local regressions",
    }
}

/// Cost of an answer, besides the cost of its fits.
#[derive(Debug, Clone, Copy)]
pub struct Cost {
    /// Price of the work, including intermediate results.
    pub work: Price,
    /// Count of numbers in the answer.
    pub n_numbers: usize,
    /// Count of numbers in the request besides its clouds: values and queries.
    pub n_held: usize,
}

/// Flops for a number of an answer, which is computed from others and copied: 5 ns.
const FLOPS_PER_NUMBER: f64 = 100.0;

impl Cost {
    /// Flops of the work and of its answer.
    pub fn flops(&self) -> f64 {
        self.work.flops + FLOPS_PER_NUMBER * self.n_numbers as f64
    }

    /// Bytes of the answer as numbers, of a second copy during assembly, and of intermediate results.
    pub fn n_bytes(&self) -> usize {
        self.n_numbers.saturating_mul(2 * size_of::<f64>()).saturating_add(self.work.n_bytes)
    }
}
