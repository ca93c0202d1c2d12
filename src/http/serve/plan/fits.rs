//! All fits of a request.

use super::{Cost, FitPlan, PlannedFit};
use crate::http::fields::DuplicatePolicy;
use crate::http::problem::Problem;
use gramian_numerics::observer::Observer;
use gramian_numerics::points::duplicates::merging_flops;

/// The fits of a request as it defines them, and the cost of the work on them.
pub struct PlannedFits {
    /// Fit of the values, or of the surface where there are no values.
    pub main: PlannedFit,
    /// Fit of the surface, if the operation needs both values and a surface.
    pub surface: Option<PlannedFit>,
    /// Whether the work needs a surface: that of the `surface` fit, or else of the `main` fit.
    pub has_surface: bool,
    pub cost: Cost,
}

/// The complete fits of a request, and the cost of the work on them.
pub struct FitPlans {
    pub main: FitPlan,
    surface: Option<FitPlan>,
    pub has_surface: bool,
    pub cost: Cost,
}

impl PlannedFits {
    /// Returns a fit that needs to know more of its cloud or its values.
    pub fn lacking_mut(&mut self) -> Option<&mut PlannedFit> {
        let mut fits = [Some(&mut self.main), self.surface.as_mut()].into_iter().flatten();
        fits.find(|fit| fit.lack().is_some())
    }

    /// Flops of [`PlannedFits::resolve`]: of merging points that coincide.
    pub fn resolving_flops(&self) -> f64 {
        let merged = self.each().map(PlannedFit::on).filter(|on| on.duplicates == DuplicatePolicy::Merge);
        merged.map(|on| merging_flops(on.n_points())).sum()
    }

    /// Bytes that the request holds until it is answered: values, queries, clouds that the cache may drop.
    pub fn n_bytes_held(&self) -> usize {
        let n_bytes = self.each().map(|fit| {
            let on = fit.on();
            on.stored.n_bytes() + 2 * size_of::<f64>() * on.n_points()
        });
        n_bytes.sum::<usize>() + self.cost.n_held * size_of::<f64>()
    }

    /// Completes the fits, once nothing is lacking.
    ///
    /// # Errors
    /// Returns the errors of [`PlannedFit::resolve`].
    pub fn resolve(self, observer: &dyn Observer) -> Result<FitPlans, Problem> {
        let Self { main, surface, has_surface, cost } = self;
        let main = main.resolve(observer)?;
        let surface = surface.map(|surface| surface.resolve(observer)).transpose()?;
        Ok(FitPlans { main, surface, has_surface, cost })
    }

    fn each(&self) -> impl Iterator<Item = &PlannedFit> {
        [Some(&self.main), self.surface.as_ref()].into_iter().flatten()
    }
}

impl FitPlans {
    /// Returns the fit of the surface, where it differs from the main fit.
    pub fn other(&self) -> Option<&FitPlan> {
        self.surface.as_ref().filter(|surface| surface.key != self.main.key)
    }
}
