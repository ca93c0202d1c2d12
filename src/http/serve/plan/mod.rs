//! The fits of a request as far as the request says, before anything is computed.

mod resolved;
mod surface;
mod values;

use std::sync::Arc;

use crate::http::fields::DuplicatePolicy;
use crate::http::problem::{Pointers, Problem};
use crate::store::Owner;
use crate::store::clouds::RegisteredCloud;
use gramian_numerics::machine::price::Price;
use gramian_numerics::model::choose::AutoLocal;
use gramian_numerics::points::sampling::Scales;
pub use resolved::FitPlan;
pub use surface::{PlannedSurface, SurfaceChoice};
pub use values::{PlannedValues, Values};

/// A cloud that is fitted for somebody, and where it stands in the request.
pub struct FittedCloud {
    pub owner: Owner,
    pub stored: Arc<RegisteredCloud>,
    pub pointers: Pointers,
    pub duplicates: DuplicatePolicy,
}

/// A fit that is checked as far as the request goes; what is left out follows from the cloud or from the values.
pub enum PlannedFit {
    Values(PlannedValues),
    Surface(PlannedSurface),
}

/// What a fit needs to know before it can be resolved, and nobody knows yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lack {
    /// The lengths of the cloud.
    Scales,
    /// The noise of its points.
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

    /// Fills in what is left out, once nothing is lacking.
    ///
    /// # Errors
    /// A [`Problem`] with a pointer to the field.
    pub fn resolve(self) -> Result<FitPlan, Problem> {
        match self {
            Self::Values(fit) => fit.resolve(),
            Self::Surface(fit) => fit.resolve(),
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
    /// Points that are factorized at most: without the duplicates that may be merged.
    pub fn n_points(&self) -> usize {
        self.stored.cloud.n_points()
    }

    /// The lengths of the cloud; a fit is resolved once it lacks nothing.
    fn scales(&self) -> Result<&Scales, Problem> {
        self.stored.scales().ok_or_else(Problem::internal)
    }
}

/// Why a solver is local that was not asked for; as the diagnostics say it.
pub fn words(reason: AutoLocal) -> &'static str {
    match reason {
        AutoLocal::BeyondDense => "the cloud has more points than are factorized densely",
        AutoLocal::ManyPoints => {
            "regressions from the nearest points take time linear in the points, of which there are many"
        }
        AutoLocal::Deviations => "standard deviations come from local regressions",
    }
}

/// What answering takes beside what the fits take.
#[derive(Debug, Clone, Copy)]
pub struct Cost {
    /// The work, and what lies on the way to the answer.
    pub work: Price,
    /// Numbers of the answer.
    pub n_numbers: usize,
    /// Numbers of the request beside its clouds: values and queries.
    pub n_held: usize,
}

impl Cost {
    /// Bytes of the answer as numbers, once more while it is put together, and of what leads to it.
    pub fn n_bytes(&self) -> usize {
        self.n_numbers.saturating_mul(2 * size_of::<f64>()).saturating_add(self.work.n_bytes)
    }
}
