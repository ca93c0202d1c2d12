//! Checks of a request, which turn its shared objects into validated inputs of the numerics.

mod choice;
mod inputs;
mod landmarks;

use std::cell::RefCell;
use std::sync::Arc;

use super::plan::{FittedCloud, PlannedSurface, PlannedValues, SurfaceSource, Values};
use crate::http::fields::kernel::PlannedKernel;
use crate::http::fields::limits::too_many_dense_points;
use crate::http::fields::{Fit, SolverChoice, Surface};
use crate::http::problem::catalogue;
use crate::http::problem::{Problem, dimension_mismatch};
use crate::http::state::app::App;
use crate::store::clouds::RegisteredCloud;
use crate::store::key::{CloudId, GivenKernel, ValuesKey};
pub use choice::RestrictedQuantity;
use choice::{
    FitOptions, TRY_LOCAL, checked_tolerance, local_lacks_operators, only_local_finds_edges,
    only_local_learns, pointers_of, pointers_of_surface,
};
use gramian_host::memory::Owner;
use gramian_numerics::error::SolverKind;
use gramian_numerics::kernel::defaults::Purpose;
use gramian_numerics::model::choose::{AutoReason, UnfittedSurface, prefers_local};
use gramian_numerics::patches::MAX_LOCAL_DIMENSION;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::surface::geometry::{GeometryRequest, SurfaceModel};
use gramian_numerics::surface::local::Learning;
use inputs::length_mismatch;
pub use inputs::{GivenValues, check_seed, unknown_cloud, unregistered, value_lists};
pub use landmarks::{LandmarkProbe, ValuesUse};

/// Planner of one request. It validates the parts of the request against the limits and the stored clouds.
pub struct Planner<'a> {
    pub app: &'a App,
    pub owner: Owner,
    known: RequestClouds,
}

/// What is known of the clouds of a request before it is planned.
#[derive(Default)]
pub struct RequestClouds {
    /// Clouds that memory may have dropped again.
    pub clouds: Vec<Arc<RegisteredCloud>>,
    /// Clouds of the request that are only in memory, or were not seen in the store lately.
    pub fresh: RefCell<Vec<Arc<RegisteredCloud>>>,
    /// Number of landmarks that span the kernel of the values, `Some(None)` if these are many.
    pub landmarks: Option<Option<usize>>,
}

impl<'a> Planner<'a> {
    pub fn new(app: &'a App, owner: Owner) -> Self {
        Self { app, owner, known: RequestClouds::default() }
    }

    /// Creates a planner that knows something of the clouds of its request.
    pub fn knowing(app: &'a App, owner: Owner, known: RequestClouds) -> Self {
        Self { app, owner, known }
    }

    pub fn into_known(self) -> RequestClouds {
        self.known
    }

    fn registered(&self, id: CloudId) -> Option<Arc<RegisteredCloud>> {
        let found = self.known.clouds.iter().find(|cloud| cloud.id == id).cloned();
        found.or_else(|| self.app.clouds.get(self.owner, id))
    }

    /// Checks the fit of values. `restricted` is a requested quantity that not every solver has, if any.
    ///
    /// # Errors
    /// Returns a [`Problem`] with a pointer to the field.
    pub fn values_fit(
        &self,
        mut fit: Fit,
        given: GivenValues,
        restricted: Option<RestrictedQuantity>,
    ) -> Result<(PlannedValues, Arc<Values>), Problem> {
        let on = self.fitted_cloud(&mut fit)?;
        let solver = self.solver_of_values(&fit, &on);
        if let Some(asked) = restricted.filter(|asked| asked.without.contains(&solver.kind)) {
            return Err(match solver.reason {
                None => asked.refused_by(solver.kind),
                Some(_) => self.beyond_dense(&on).with_remedy(&asked.remedy(solver.kind)),
            });
        }
        self.plan_given_values(on, FitOptions::of(fit), solver, given)
    }

    /// Checks the fit of a surface, by a signature function or by local regressions.
    ///
    /// # Errors
    /// Returns a [`Problem`] with a pointer to the field.
    pub fn surface_fit(
        &self,
        mut fit: Fit,
        purpose: Purpose,
        request: &GeometryRequest,
    ) -> Result<PlannedSurface, Problem> {
        let on = self.fitted_cloud(&mut fit)?;
        self.plan_surface(on, FitOptions::of(fit), purpose, request)
    }

    /// Takes the cloud of a request out of its fit.
    fn fitted_cloud(&self, fit: &mut Fit) -> Result<FittedCloud, Problem> {
        let pointers = pointers_of(&fit.cloud, fit.noise_variances.is_some());
        let stored = self.cloud(std::mem::take(&mut fit.cloud), "/cloud")?;
        let (duplicates, tolerance) = (fit.duplicates, checked_tolerance(fit)?);
        Ok(FittedCloud { owner: self.owner, stored, pointers, duplicates, tolerance })
    }

    fn plan_surface(
        &self,
        on: FittedCloud,
        mut options: FitOptions,
        purpose: Purpose,
        request: &GeometryRequest,
    ) -> Result<PlannedSurface, Problem> {
        let learning = self.learning(&mut options, &on.stored.cloud)?;
        let choice = match self.choice_of_surface(&on, &options, purpose, request)? {
            LocalDecision::Locally(reason) => {
                let learning = learning.map(|(_, learning)| learning);
                SurfaceSource::Regressions { reason, learning }
            }
            LocalDecision::No if let Some((member, _)) = learning => return Err(only_local_learns(member)),
            LocalDecision::No => {
                let solver = of_whole(options.solver);
                if solver == SolverKind::Dense {
                    self.check_max_dense_points(&on)?;
                }
                let kernel = options.kernel.as_ref().map(|kernel| kernel.plan(on.pointers)).transpose()?;
                let regularization = options.regularization(&on)?;
                SurfaceSource::Signature { solver, kernel, regularization, purpose }
            }
        };
        Ok(PlannedSurface { on, choice })
    }

    /// Returns the source of the hyperparameters of local regressions if the request specifies one, with the
    /// name of the member that specifies it.
    fn learning(
        &self,
        options: &mut FitOptions,
        cloud: &Cloud,
    ) -> Result<Option<(&'static str, Learning)>, Problem> {
        match (options.sites.take(), options.hyperparameters.take()) {
            (None, None) => Ok(None),
            (Some(sites), None) => Ok(Some(("sites", Learning::AtSites(self.sites(sites, cloud)?)))),
            (None, Some(given)) => Ok(Some(("hyperparameters", Learning::Known(Arc::new(given.plan()?))))),
            (Some(_), Some(_)) => {
                let detail = "sites and hyperparameters exclude each other; give one of them";
                Err(Problem::invalid_request("/sites", detail))
            }
        }
    }

    /// Decides whether a surface is regressed locally, with the reason where `auto` chose that.
    fn choice_of_surface(
        &self,
        on: &FittedCloud,
        options: &FitOptions,
        purpose: Purpose,
        request: &GeometryRequest,
    ) -> Result<LocalDecision, Problem> {
        let (n_points, dimension) = (on.stored.cloud.n_points(), on.stored.cloud.dimension());
        let given = options.given_process(on.pointers);
        if options.solver == SolverChoice::Local || request.model == SurfaceModel::Regression {
            let pointer =
                if options.solver == SolverChoice::Local { "/solver" } else { on.pointers.surface_model };
            if dimension > MAX_LOCAL_DIMENSION {
                let detail = format!(
                    "local regressions serve surfaces in dimensions 2 to {MAX_LOCAL_DIMENSION}, the cloud has {dimension}"
                );
                return Err(Problem::of_field(catalogue::UNSUPPORTED_BY_SOLVER, pointer, detail));
            }
            if let Some(pointer) = given {
                let detail = "local regressions choose kernel and noise by their likelihood; leave this out, or take \
                              the surface model \"signature\"";
                return Err(Problem::of_field(catalogue::UNSUPPORTED_BY_SOLVER, pointer, detail));
            }
            return Ok(LocalDecision::Locally(None));
        }
        let is_named =
            options.solver != SolverChoice::Auto || request.model != SurfaceModel::Auto || given.is_some();
        if request.has_edge_normals && (is_named || dimension > MAX_LOCAL_DIMENSION) {
            return Err(only_local_finds_edges());
        }
        if is_named {
            return Ok(LocalDecision::No);
        }
        let only_regressed = match (request.has_edge_normals, request.has_deviations) {
            (true, _) => Some(AutoReason::EdgeNormals),
            (false, true) => Some(AutoReason::Deviations),
            (false, false) => None,
        };
        let surface = UnfittedSurface { n_points, dimension, purpose, only_regressed };
        Ok(match prefers_local(&surface, self.app.config.max_dense_points) {
            None => LocalDecision::No,
            reason => LocalDecision::Locally(reason),
        })
    }

    /// Checks the nodes of stencils and the fit of the surface under them.
    ///
    /// # Errors
    /// Returns a [`Problem`] with a pointer to the field.
    pub fn stencils(
        &self,
        mut fit: Fit,
        surface: Option<Surface>,
        request: &GeometryRequest,
    ) -> Result<(Arc<RegisteredCloud>, PlannedSurface), Problem> {
        let on = self.fitted_cloud(&mut fit)?;
        let nodes = on.stored.clone();
        // Nodes need no solver, so the options of the request are those of the surface.
        let SurfaceUnder { on, options, .. } = self.surface_under(&on, FitOptions::of(fit), surface)?;
        Ok((nodes, self.plan_surface(on, options, Purpose::Curvatures, request)?))
    }

    /// Checks the fits of values and of the surface under them, for an operator on the values.
    ///
    /// Values are kriged around each query if they exceed the dense limit, or if the client requests it.
    ///
    /// # Errors
    /// Returns a [`Problem`] with a pointer to the field.
    pub fn operator_fits(
        &self,
        mut fit: Fit,
        given: GivenValues,
        surface: Option<Surface>,
        request: &GeometryRequest,
    ) -> Result<OperatorFits, Problem> {
        let on = self.fitted_cloud(&mut fit)?;
        let (solver, options) = (self.solver_of_values(&fit, &on), FitOptions::of(fit));
        let under = self.surface_under(&on, options.clone(), surface)?;
        let (main, values) = self.plan_given_values(on, options, solver, given)?;
        Ok(OperatorFits { main, values, surface: self.plan_surface_under(under, request)? })
    }

    /// Chooses the solver of values where several would do, with the reason where `auto` did not choose the
    /// dense one.
    fn solver_of_values(&self, fit: &Fit, on: &FittedCloud) -> ValuesSolver {
        match fit.solver {
            SolverChoice::Local => ValuesSolver::asked(SolverKind::Local),
            SolverChoice::Auto if let Some(Some(_)) = self.known.landmarks => {
                ValuesSolver { kind: SolverKind::Landmark, reason: Some(AutoReason::FewLandmarks) }
            }
            SolverChoice::Auto if on.n_points() > self.app.config.max_dense_points => {
                let (kind, reason) = match fit.tolerance {
                    Some(_) => (SolverKind::Iterative, AutoReason::Tolerance),
                    None => (SolverKind::Local, AutoReason::BeyondDense),
                };
                ValuesSolver { kind, reason: Some(reason) }
            }
            SolverChoice::Landmark => ValuesSolver::asked(SolverKind::Landmark),
            SolverChoice::Iterative => ValuesSolver::asked(SolverKind::Iterative),
            SolverChoice::Auto | SolverChoice::Dense => ValuesSolver::asked(SolverKind::Dense),
        }
    }

    /// Checks the two fits behind an operator matrix: that of the values, which are not given, and that of
    /// the surface under them.
    ///
    /// Fields that `surface` leaves out are those of the request.
    ///
    /// # Errors
    /// Returns a [`Problem`] with a pointer to the field.
    pub fn matrix_fits(
        &self,
        mut fit: Fit,
        surface: Option<Surface>,
        request: &GeometryRequest,
    ) -> Result<(PlannedValues, PlannedSurface), Problem> {
        if fit.solver == SolverChoice::Local {
            return Err(local_lacks_operators("/solver"));
        }
        if fit.solver == SolverChoice::Iterative {
            return Err(RestrictedQuantity {
                name: "matrices",
                pointer: "/solver",
                without: &[SolverKind::Iterative],
            }
            .refused_by(SolverKind::Iterative));
        }
        let on = self.fitted_cloud(&mut fit)?;
        let (solver, options) = (ValuesSolver::asked(of_whole(fit.solver)), FitOptions::of(fit));
        let under = self.surface_under(&on, options.clone(), surface)?;
        let main = self.plan_values(on, options, solver, Mean::Zero)?;
        Ok((main, self.plan_surface_under(under, request)?))
    }

    /// Checks the surface under values or nodes. Fields that `surface` leaves out are those of the request.
    fn surface_under(
        &self,
        values: &FittedCloud,
        options: FitOptions,
        surface: Option<Surface>,
    ) -> Result<SurfaceUnder, Problem> {
        let surface = surface.unwrap_or_default();
        let pointers = pointers_of_surface(&surface, values.pointers);
        let stored = match surface.cloud {
            None => values.stored.clone(),
            Some(cloud) => self.cloud(cloud, "/surface/cloud")?,
        };
        let (expected, found) = (values.stored.cloud.dimension(), stored.cloud.dimension());
        if expected != found {
            return Err(dimension_mismatch("/surface/cloud", expected, found));
        }
        let inherits_noise = surface.alpha.is_none() && surface.noise_variances.is_none();
        if inherits_noise && options.noise_variances.is_some() && stored.id != values.stored.id {
            let detail =
                "noise_variances belong to the points of cloud; give alpha or noise_variances here as well";
            return Err(Problem::invalid_request("/surface", detail));
        }
        let has_own_process = surface.kernel.is_some() || !inherits_noise;
        let (alpha, noise_variances) = if inherits_noise {
            (options.alpha, options.noise_variances)
        } else {
            (surface.alpha, surface.noise_variances)
        };
        let options = FitOptions {
            kernel: surface.kernel.or(options.kernel),
            alpha,
            noise_variances,
            solver: surface.solver.unwrap_or(options.solver),
            mean: None,
            sites: options.sites,
            hyperparameters: options.hyperparameters,
        };
        let on = FittedCloud { stored, pointers, ..values.clone() };
        Ok(SurfaceUnder { on, options, has_own_process })
    }

    /// Plans the surface under values. Local regressions do not inherit the kernel of the values.
    fn plan_surface_under(
        &self,
        SurfaceUnder { on, options, has_own_process }: SurfaceUnder,
        request: &GeometryRequest,
    ) -> Result<PlannedSurface, Problem> {
        let solver = options.solver;
        let is_beyond = on.n_points() > self.app.config.max_dense_points;
        let is_local = solver == SolverChoice::Local
            || request.model == SurfaceModel::Regression
            || solver == SolverChoice::Auto && is_beyond;
        let options = if is_local && !has_own_process {
            FitOptions { solver, hyperparameters: options.hyperparameters, ..FitOptions::default() }
        } else {
            options
        };
        self.plan_surface(on, options, Purpose::Curvatures, request)
    }

    /// Admits a cloud to the dense solver.
    ///
    /// No other code checks the dense limit. Solvers that never factorize all points at once have only the
    /// limit of [`Planner::register`].
    fn check_max_dense_points(&self, on: &FittedCloud) -> Result<(), Problem> {
        if on.n_points() <= self.app.config.max_dense_points {
            return Ok(());
        }
        Err(self.beyond_dense(on).with_remedy(TRY_LOCAL))
    }

    /// Returns 413 for a cloud with too many points for one factorization.
    fn beyond_dense(&self, on: &FittedCloud) -> Problem {
        too_many_dense_points(self.app.config.max_dense_points, on.n_points()).at(on.pointers.points)
    }

    fn plan_values(
        &self,
        on: FittedCloud,
        options: FitOptions,
        solver: ValuesSolver,
        default_mean: Mean,
    ) -> Result<PlannedValues, Problem> {
        let ValuesSolver { kind, reason } = solver;
        if kind == SolverKind::Dense {
            self.check_max_dense_points(&on)?;
        }
        let kernel = options.kernel.as_ref().map(|kernel| kernel.plan(on.pointers)).transpose()?;
        let mean = options.mean.unwrap_or(default_mean);
        let regularization = options.regularization(&on)?;
        let (values, learned) = (None, None);
        Ok(PlannedValues { on, kernel, regularization, solver: kind, reason, mean, values, learned })
    }

    /// Plans the fit of values, with the results learned from them, if they are known.
    fn plan_given_values(
        &self,
        on: FittedCloud,
        options: FitOptions,
        solver: ValuesSolver,
        given: GivenValues,
    ) -> Result<(PlannedValues, Arc<Values>), Problem> {
        // A kernel that follows from the values comes with a mean.
        let default_mean = if options.kernel.is_none() { Mean::Constant } else { Mean::Zero };
        let mut plan = self.plan_values(on, options, solver, default_mean)?;
        let GivenValues { list, n_lists } = given;
        let stored = &plan.on.stored;
        match n_lists {
            None => self.check_values_of(&list, &stored.cloud)?,
            Some(n_lists) if list.len() != n_lists * plan.on.n_points() => {
                return Err(length_mismatch("/values/0", &stored.cloud, list.len() / n_lists));
            }
            Some(_) => {}
        }
        let key = ValuesKey::with_mean(&list, plan.mean);
        // A length scale that follows from the cloud is always the same, so the key has only family and
        // variance.
        let kernel = plan.kernel.as_ref().map(|kernel| match kernel {
            PlannedKernel::Given(kernel) => GivenKernel::Whole(kernel),
            &PlannedKernel::OfCloud { family, variance } => GivenKernel::OfCloud(family, variance),
        });
        let learned_key = (self.owner, stored.id, key.given(kernel, plan.regularization.as_ref()));
        plan.learned = self.app.learned.get(learned_key);
        let values = Arc::new(Values { list, n_lists: n_lists.unwrap_or(1), key, learned_key });
        plan.values = Some(values.clone());
        Ok((plan, values))
    }
}

/// Fits of an operator on values.
pub struct OperatorFits {
    pub main: PlannedValues,
    pub values: Arc<Values>,
    pub surface: PlannedSurface,
}

/// Returns the solver of one system over all points that a choice stands for.
fn of_whole(choice: SolverChoice) -> SolverKind {
    match choice {
        SolverChoice::Landmark => SolverKind::Landmark,
        SolverChoice::Iterative => SolverKind::Iterative,
        SolverChoice::Auto | SolverChoice::Dense | SolverChoice::Local => SolverKind::Dense,
    }
}

/// Decision for or against local regressions of a surface.
enum LocalDecision {
    No,
    /// Local regressions, with the reason where `auto` chose them.
    Locally(Option<AutoReason>),
}

/// Solver of values, with the reason where `auto` did not choose the dense one.
#[derive(Clone, Copy)]
struct ValuesSolver {
    kind: SolverKind,
    reason: Option<AutoReason>,
}

impl ValuesSolver {
    fn asked(kind: SolverKind) -> Self {
        Self { kind, reason: None }
    }
}

/// A surface under values or nodes.
struct SurfaceUnder {
    on: FittedCloud,
    options: FitOptions,
    /// Whether `surface` gives kernel or noise, so that they are not those of the values.
    has_own_process: bool,
}
