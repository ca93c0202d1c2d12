//! From the shared objects of a request to validated inputs of the numerics.

mod choice;
mod inputs;

use std::cell::RefCell;
use std::sync::Arc;

use super::plan::{LocalReason, PlannedFit, PlannedValues, Way};
use crate::http::fields::kernel::PlannedKernel;
use crate::http::fields::{DuplicatePolicy, Fit, Geometry, SolverChoice};
use crate::http::problem::slug::Slug;
use crate::http::problem::{Pointers, Problem};
use crate::http::state::app::App;
use crate::http::wire::read::limits::too_many_dense_points;
use crate::store::Owner;
use crate::store::clouds::RegisteredCloud;
use crate::store::key::{CloudId, GivenKernel, ValuesKey};
pub use choice::DenseOnly;
use choice::{
    Chosen, TRY_LOCAL, local_lacks_operators, only_local_has_sites, pointers_of, pointers_of_surface,
};
use gramian_numerics::defaults::Purpose;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::solver::choose::{AutoLocal, MAX_LOCAL_DIMENSION, prefers_local};
use gramian_numerics::solver::trend::Mean;
use gramian_numerics::sums::regularization::Regularization;
use gramian_numerics::surface::geometry::{GeometryRequest, SurfaceModel};
use inputs::length_mismatch;
pub use inputs::{check_seed, unknown_cloud, value_lists};

/// Validates the parts of a request against the limits and the stored clouds.
pub struct Planner<'a> {
    pub app: &'a App,
    pub owner: Owner,
    /// Clouds that were found elsewhere than in memory.
    found: Vec<Arc<RegisteredCloud>>,
    /// Clouds that came with the request, and are in memory alone, or were not seen in the store lately.
    fresh: RefCell<Vec<Arc<RegisteredCloud>>>,
}

impl<'a> Planner<'a> {
    pub fn new(app: &'a App, owner: Owner) -> Self {
        Self::with_clouds(app, owner, Vec::new())
    }

    /// One that knows clouds which memory may have let go again.
    pub fn with_clouds(app: &'a App, owner: Owner, found: Vec<Arc<RegisteredCloud>>) -> Self {
        Self { app, owner, found, fresh: RefCell::default() }
    }

    /// Clouds that came with the request, and are in memory alone.
    pub fn into_fresh(self) -> Vec<Arc<RegisteredCloud>> {
        self.fresh.into_inner()
    }

    fn registered(&self, id: CloudId) -> Option<Arc<RegisteredCloud>> {
        let found = self.found.iter().find(|cloud| cloud.id == id).cloned();
        found.or_else(|| self.app.clouds.get(self.owner, id))
    }

    /// Checks the fit of values. `dense_only` is what is asked that only a dense factorization has, if anything.
    ///
    /// # Errors
    /// A [`Problem`] with a pointer to the field.
    pub fn values_fit(&self, mut fit: Fit, dense_only: Option<DenseOnly>) -> Result<PlannedFit, Problem> {
        let pointers = pointers_of(&fit);
        let stored = self.cloud(std::mem::take(&mut fit.cloud), "/cloud")?;
        let way = match (self.way_of_values(&fit, &stored), dense_only) {
            (Way::Moving(LocalReason::Asked), Some(asked)) => return Err(asked.refused_by_local()),
            (Way::Moving(_), Some(asked)) => {
                return Err(self.beyond_dense(&stored, pointers).with_remedy(&asked.remedy()));
            }
            (way, _) => way,
        };
        let duplicates = fit.duplicates;
        self.plan(stored, Chosen::of(fit), way, duplicates, Purpose::Values, pointers)
    }

    /// Checks the fit of a surface: of a signature function, or local regressions.
    ///
    /// # Errors
    /// A [`Problem`] with a pointer to the field.
    pub fn surface_fit(
        &self,
        mut fit: Fit,
        purpose: Purpose,
        request: &GeometryRequest,
    ) -> Result<PlannedFit, Problem> {
        let pointers = pointers_of(&fit);
        let stored = self.cloud(std::mem::take(&mut fit.cloud), "/cloud")?;
        let (solver, duplicates) = (fit.solver, fit.duplicates);
        self.plan_surface(stored, Chosen::of(fit), solver, duplicates, (purpose, request), pointers)
    }

    fn plan_surface(
        &self,
        stored: Arc<RegisteredCloud>,
        chosen: Chosen,
        solver: SolverChoice,
        duplicates: DuplicatePolicy,
        (purpose, request): (Purpose, &GeometryRequest),
        pointers: Pointers,
    ) -> Result<PlannedFit, Problem> {
        let Some(reason) = self.local_reason(&stored.cloud, &chosen, solver, request, pointers)? else {
            if chosen.sites.is_some() {
                return Err(only_local_has_sites());
            }
            return self.plan(stored, chosen, Way::Dense, duplicates, purpose, pointers);
        };
        let sites = chosen.sites.map(|sites| self.sites(sites, &stored.cloud)).transpose()?;
        let way = Way::Regressions { reason, sites };
        let (kernel, regularization) = (None, None);
        Ok(PlannedFit {
            owner: self.owner,
            stored,
            pointers,
            kernel,
            regularization,
            duplicates,
            purpose,
            way,
            values: None,
            mean: Mean::Zero,
        })
    }

    /// Why a surface is regressed locally, if it is.
    fn local_reason(
        &self,
        cloud: &Cloud,
        chosen: &Chosen,
        solver: SolverChoice,
        request: &GeometryRequest,
        pointers: Pointers,
    ) -> Result<Option<LocalReason>, Problem> {
        let (n, d) = (cloud.n_points(), cloud.dimension());
        let given = [
            (chosen.kernel.is_some(), pointers.kernel),
            (chosen.alpha.is_some() || chosen.noise_variances.is_some(), pointers.regularization),
        ];
        let given = given.into_iter().find_map(|(is_given, pointer)| is_given.then_some(pointer));
        if solver == SolverChoice::Local || request.model == SurfaceModel::Local {
            let pointer = if solver == SolverChoice::Local { "/solver" } else { "/surface" };
            if !(2..=MAX_LOCAL_DIMENSION).contains(&d) && d >= 2 {
                let detail = format!(
                    "local regressions serve surfaces in dimensions 2 to {MAX_LOCAL_DIMENSION}, the cloud has {d}"
                );
                return Err(Problem::of_field(Slug::UnsupportedBySolver, pointer, detail));
            }
            if let Some(pointer) = given {
                let detail = "local regressions choose kernel and noise by their likelihood; leave this out, or take \
                              \"surface\": \"signature\"";
                return Err(Problem::of_field(Slug::UnsupportedBySolver, pointer, detail));
            }
            return Ok(Some(LocalReason::Asked));
        }
        if solver != SolverChoice::Auto || request.model != SurfaceModel::Auto || given.is_some() {
            return Ok(None);
        }
        let max_dense_points = self.app.config.max_dense_points;
        let reason = prefers_local(n, d, max_dense_points, request.has_deviations);
        Ok(reason.map(LocalReason::Auto))
    }

    /// The nodes of stencils and the fit of the surface under them.
    ///
    /// # Errors
    /// A [`Problem`] with a pointer to the field.
    pub fn stencils(
        &self,
        mut fit: Fit,
        geometry: Option<Geometry>,
        request: &GeometryRequest,
    ) -> Result<(Arc<RegisteredCloud>, PlannedFit), Problem> {
        let pointers = pointers_of(&fit);
        let nodes = self.cloud(std::mem::take(&mut fit.cloud), "/cloud")?;
        // The nodes need no solver: what is said of them is said of the surface.
        let (_, surface) = self.fits_over((nodes.clone(), pointers), fit, geometry, request, None)?;
        Ok((nodes, surface))
    }

    /// The fits of values and of the surface under them, for an operator on the values: kriged around each query where they are more than are
    /// factorized, or where that is asked for.
    ///
    /// # Errors
    /// A [`Problem`] with a pointer to the field.
    pub fn operator_fits(
        &self,
        mut fit: Fit,
        geometry: Option<Geometry>,
        request: &GeometryRequest,
    ) -> Result<(PlannedFit, PlannedFit), Problem> {
        let pointers = pointers_of(&fit);
        let cloud = self.cloud(std::mem::take(&mut fit.cloud), "/cloud")?;
        let way = self.way_of_values(&fit, &cloud);
        let (values, surface) = self.fits_over((cloud, pointers), fit, geometry, request, Some(way))?;
        Ok((values.ok_or_else(Problem::internal)?, surface))
    }

    /// How values are served where either solver has what is asked.
    fn way_of_values(&self, fit: &Fit, cloud: &RegisteredCloud) -> Way {
        match fit.solver {
            SolverChoice::Local => Way::Moving(LocalReason::Asked),
            SolverChoice::Auto if cloud.cloud.n_points() > self.app.config.max_dense_points => {
                Way::Moving(LocalReason::Auto(AutoLocal::BeyondDense))
            }
            SolverChoice::Auto | SolverChoice::Dense => Way::Dense,
        }
    }

    /// Checks the fits of values and of the surface that they live on; what `geometry` leaves out is as in the request.
    ///
    /// # Errors
    /// A [`Problem`] with a pointer to the field.
    pub fn fits(
        &self,
        mut fit: Fit,
        geometry: Option<Geometry>,
        request: &GeometryRequest,
    ) -> Result<(PlannedFit, PlannedFit), Problem> {
        if fit.solver == SolverChoice::Local {
            return Err(local_lacks_operators("/solver"));
        }
        let pointers = pointers_of(&fit);
        let cloud = self.cloud(std::mem::take(&mut fit.cloud), "/cloud")?;
        let (values, surface) =
            self.fits_over((cloud, pointers), fit, geometry, request, Some(Way::Dense))?;
        Ok((values.ok_or_else(Problem::internal)?, surface))
    }

    fn fits_over(
        &self,
        (values_cloud, pointers): (Arc<RegisteredCloud>, Pointers),
        fit: Fit,
        geometry: Option<Geometry>,
        request: &GeometryRequest,
        way_of_values: Option<Way>,
    ) -> Result<(Option<PlannedFit>, PlannedFit), Problem> {
        let geometry = geometry.unwrap_or_default();
        let surface_pointers = pointers_of_surface(&geometry, pointers);
        let surface_cloud = match geometry.cloud {
            None => values_cloud.clone(),
            Some(cloud) => self.cloud(cloud, "/geometry/cloud")?,
        };
        let (expected, found) = (values_cloud.cloud.dimension(), surface_cloud.cloud.dimension());
        if expected != found {
            return Err(Problem::dimension_mismatch("/geometry/cloud", expected, found));
        }
        let (solver, duplicates) = (geometry.solver.unwrap_or(fit.solver), fit.duplicates);
        let mut chosen = Chosen::of(fit);
        let sites = chosen.sites.take();
        let inherits_noise = geometry.alpha.is_none() && geometry.noise_variances.is_none();
        if inherits_noise && chosen.noise_variances.is_some() && surface_cloud.id != values_cloud.id {
            let detail =
                "noise_variances belong to the points of cloud; give alpha or noise_variances here as well";
            return Err(Problem::invalid_request("/geometry", detail));
        }
        // Local regressions take no kernel: that of the values is not meant for them.
        let is_beyond = surface_cloud.cloud.n_points() > self.app.config.max_dense_points;
        let is_local = solver == SolverChoice::Local
            || request.model == SurfaceModel::Local
            || solver == SolverChoice::Auto && is_beyond;
        let has_own = geometry.kernel.is_some() || !inherits_noise;
        let surface_chosen = if is_local && !has_own && way_of_values.is_some() {
            Chosen::default()
        } else {
            Chosen {
                kernel: geometry.kernel.or_else(|| chosen.kernel.clone()),
                alpha: if inherits_noise { chosen.alpha } else { geometry.alpha },
                noise_variances: match inherits_noise {
                    true => chosen.noise_variances.clone(),
                    false => geometry.noise_variances,
                },
                sites,
                ..Chosen::default()
            }
        };
        let plan = |way| self.plan(values_cloud, chosen, way, duplicates, Purpose::Values, pointers);
        let values = way_of_values.map(plan).transpose()?;
        let asked = (Purpose::Curvatures, request);
        let surface =
            self.plan_surface(surface_cloud, surface_chosen, solver, duplicates, asked, surface_pointers)?;
        Ok((values, surface))
    }

    /// Admits a cloud to the dense solver. This is the one place that holds it to its limit: for solvers that never factorize all
    /// points at once, it is [`Planner::register`] that has.
    fn check_max_dense_points(&self, stored: &RegisteredCloud, pointers: Pointers) -> Result<(), Problem> {
        if stored.cloud.n_points() <= self.app.config.max_dense_points {
            return Ok(());
        }
        Err(self.beyond_dense(stored, pointers).with_remedy(TRY_LOCAL))
    }

    /// 413 for a cloud of too many points to be factorized at once.
    fn beyond_dense(&self, stored: &RegisteredCloud, pointers: Pointers) -> Problem {
        let (limit, required) = (self.app.config.max_dense_points, stored.cloud.n_points());
        too_many_dense_points(limit, required).at(pointers.points)
    }

    fn plan(
        &self,
        stored: Arc<RegisteredCloud>,
        chosen: Chosen,
        way: Way,
        duplicates: DuplicatePolicy,
        purpose: Purpose,
        pointers: Pointers,
    ) -> Result<PlannedFit, Problem> {
        if way == Way::Dense {
            self.check_max_dense_points(&stored, pointers)?;
        }
        let kernel = chosen.kernel.as_ref().map(|kernel| kernel.plan(pointers)).transpose()?;
        let follows = kernel.is_none() && chosen.values.is_some();
        let mean = chosen.mean.unwrap_or(if follows { Mean::Constant } else { Mean::Zero });
        let (values, n_lists) = (chosen.values.clone(), chosen.n_lists);
        let regularization = chosen.regularization(&stored, pointers)?;
        let values = values
            .map(|values| {
                self.planned_values((values, n_lists), mean, &stored, kernel.as_ref(), &regularization)
            })
            .transpose()?;
        Ok(PlannedFit {
            owner: self.owner,
            stored,
            pointers,
            kernel,
            regularization,
            duplicates,
            purpose,
            way,
            values,
            mean,
        })
    }

    /// Values of a fit, with what was learned from them if that is known.
    fn planned_values(
        &self,
        (values, n_lists): (Arc<Vec<f64>>, usize),
        mean: Mean,
        stored: &RegisteredCloud,
        kernel: Option<&PlannedKernel>,
        regularization: &Option<Regularization>,
    ) -> Result<Box<PlannedValues>, Problem> {
        match n_lists {
            0 => self.check_values_of(&values, &stored.cloud)?,
            _ if values.len() != n_lists * stored.cloud.n_points() => {
                return Err(length_mismatch("/values/0", &stored.cloud, values.len() / n_lists));
            }
            _ => {}
        }
        let named = ValuesKey::with_mean(&values, mean);
        // A length scale that the cloud gives is the same whenever it is asked for.
        let given = kernel.map(|kernel| match kernel {
            PlannedKernel::Given(kernel) => GivenKernel::Whole(kernel),
            &PlannedKernel::OfCloud { family, variance } => GivenKernel::OfCloud(family, variance),
        });
        let key = (self.owner, stored.id, named.given(given, regularization.as_ref()));
        Ok(Box::new(PlannedValues { values, key, learned: self.app.learned.get(key) }))
    }
}
