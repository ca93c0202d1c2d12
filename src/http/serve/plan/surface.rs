//! Fit of the surface that a cloud samples.

use super::resolved::{ChosenRecipe, Process};
use super::{FitPlan, FittedCloud, Lack};
use crate::http::fields::kernel::PlannedKernel;
use crate::http::problem::{Problem, from_numerics};
use gramian_numerics::error::SolverKind;
use gramian_numerics::kernel::defaults::{Purpose, default_fit};
use gramian_numerics::model::choose::AutoReason;
use gramian_numerics::model::{Recipe, ScaledProcess};
use gramian_numerics::observer::Observer;
use gramian_numerics::regression::sums::regularization::Regularization;
use gramian_numerics::surface::local::Learning;

/// A fit of a surface.
pub struct PlannedSurface {
    pub on: FittedCloud,
    pub(in crate::http::serve) choice: SurfaceSource,
}

/// Definition of a surface.
pub enum SurfaceSource {
    /// A level of a signature function.
    Signature {
        solver: SolverKind,
        kernel: Option<PlannedKernel>,
        regularization: Option<Regularization>,
        purpose: Purpose,
    },
    /// Local regressions. They learn all over the cloud, unless `learning` says otherwise. `reason` is set
    /// where `auto` chose them.
    Regressions { reason: Option<AutoReason>, learning: Option<Learning> },
}

impl PlannedSurface {
    pub fn solver(&self) -> SolverKind {
        match self.choice {
            SurfaceSource::Signature { solver, .. } => solver,
            SurfaceSource::Regressions { .. } => SolverKind::Local,
        }
    }

    pub(in crate::http::serve) fn lack(&self) -> Option<Lack> {
        let SurfaceSource::Signature { kernel, regularization, .. } = &self.choice else { return None };
        let is_given = matches!(kernel, Some(PlannedKernel::Given(_)));
        if !is_given && self.on.stored.scales().is_none() {
            return Some(Lack::Scales);
        }
        let follows = kernel.is_none() && regularization.is_none();
        (follows && self.on.stored.noise().is_none()).then_some(Lack::Noise)
    }

    pub(super) fn resolve(self, observer: &dyn Observer) -> Result<FitPlan, Problem> {
        let Self { on, choice } = self;
        let refuse = |error| from_numerics(error, on.pointers);
        let (solver, kernel, regularization, purpose) = match choice {
            SurfaceSource::Signature { solver, kernel, regularization, purpose } => {
                (solver, kernel, regularization, purpose)
            }
            SurfaceSource::Regressions { reason, learning } => {
                let recipe = ChosenRecipe { recipe: Recipe::LocalSurface { learning }, reason };
                return FitPlan::of(on, recipe, Process::default(), observer);
            }
        };
        let scaled = match kernel {
            Some(kernel) => {
                let kernel = kernel.resolve(on.stored.scales(), purpose, on.pointers)?;
                ScaledProcess::of(kernel, regularization).map_err(refuse)?
            }
            None => {
                // The noise matters only if no regularization is given.
                let noise = || on.stored.noise().unwrap_or_default();
                let (kernel, alpha) = default_fit(on.scales()?, purpose, noise).map_err(refuse)?;
                ScaledProcess::by_rule(kernel, alpha, regularization).map_err(refuse)?
            }
        };
        let ScaledProcess { kernel, regularization, scale } = scaled;
        let recipe = Recipe::of_values(solver, kernel, regularization);
        let recipe = ChosenRecipe { recipe, reason: None };
        FitPlan::of(on, recipe, Process { scale, ..Process::default() }, observer)
    }
}
