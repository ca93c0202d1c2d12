//! From the shared objects of a request to validated inputs of the numerics.

use std::cell::RefCell;
use std::sync::Arc;

use super::durable::TRUST;
use super::plan::{LocalReason, PlannedFit, PlannedValues, Way};
use crate::http::fields::kernel::PlannedKernel;
use crate::http::fields::{CloudRef, DuplicatePolicy, Fit, Geometry, Kernel, SolverChoice};
use crate::http::problem::slug::Slug;
use crate::http::problem::{Pointers, Problem};
use crate::http::serve::app::App;
use crate::http::wire::read::limits::{
    too_many_coordinates, too_many_dense_points, too_many_points, too_many_queries, transposed,
};
use crate::http::wire::read::points::{Points, ValueLists};
use crate::numerics::defaults::Purpose;
use crate::numerics::error::NumericsError;
use crate::numerics::points::cloud::Cloud;
use crate::numerics::solver::choose::{AutoLocal, MAX_LOCAL_DIMENSION, prefers_local};
use crate::numerics::solver::trend::Mean;
use crate::numerics::sums::regularization::Regularization;
use crate::numerics::surface::geometry::{GeometryRequest, SurfaceModel};
use crate::store::Owner;
use crate::store::clouds::RegisteredCloud;
use crate::store::key::{CloudId, GivenKernel, ValuesKey};

/// Bytes that a number takes in JSON at most, with its comma.
const BYTES_PER_NUMBER: usize = 25;

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
        let is_beyond = stored.cloud.n_points() > self.app.config.max_dense_points;
        let way = match (fit.solver, dense_only) {
            (SolverChoice::Local, None) => Way::Moving(LocalReason::Asked),
            (SolverChoice::Local, Some(asked)) => return Err(asked.refused_by_local()),
            (SolverChoice::Auto, None) if is_beyond => Way::Moving(LocalReason::Auto(AutoLocal::BeyondDense)),
            (SolverChoice::Auto, Some(asked)) if is_beyond => {
                return Err(self.beyond_dense(&stored, pointers).with_remedy(&asked.remedy()));
            }
            (SolverChoice::Auto | SolverChoice::Dense, _) => Way::Dense,
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
            return self.plan(stored, chosen, Way::Dense, duplicates, purpose, pointers);
        };
        let way = Way::Regressions(reason);
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

    /// Whether an operator on values is asked of stencils: by name, or since there are more nodes than are factorized and nothing is said
    /// of their kernel.
    fn wants_stencils(&self, fit: &Fit, nodes: &RegisteredCloud) -> bool {
        let is_free = fit.kernel.is_none() && fit.alpha.is_none() && fit.noise_variances.is_none();
        match fit.solver {
            SolverChoice::Local => true,
            SolverChoice::Auto => is_free && nodes.cloud.n_points() > self.app.config.max_dense_points,
            SolverChoice::Dense => false,
        }
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
        let (_, surface) = self.fits_over((nodes.clone(), pointers), fit, geometry, request, false)?;
        Ok((nodes, surface))
    }

    /// [`Planner::stencils`] where they are wanted, else [`Planner::fits`].
    ///
    /// # Errors
    /// A [`Problem`] with a pointer to the field.
    pub fn operator_fits(
        &self,
        mut fit: Fit,
        geometry: Option<Geometry>,
        request: &GeometryRequest,
    ) -> Result<OperatorFits, Problem> {
        let pointers = pointers_of(&fit);
        let nodes = self.cloud(std::mem::take(&mut fit.cloud), "/cloud")?;
        let wants_stencils = self.wants_stencils(&fit, &nodes);
        let over = (nodes.clone(), pointers);
        let (values, surface) = self.fits_over(over, fit, geometry, request, !wants_stencils)?;
        Ok(match values {
            None => OperatorFits::Stencils { nodes, surface },
            Some(values) => OperatorFits::Solved { values, surface },
        })
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
        let (values, surface) = self.fits_over((cloud, pointers), fit, geometry, request, true)?;
        Ok((values.ok_or_else(Problem::internal)?, surface))
    }

    fn fits_over(
        &self,
        (values_cloud, pointers): (Arc<RegisteredCloud>, Pointers),
        fit: Fit,
        geometry: Option<Geometry>,
        request: &GeometryRequest,
        has_values: bool,
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
        let chosen = Chosen::of(fit);
        let inherits_noise = geometry.alpha.is_none() && geometry.noise_variances.is_none();
        if inherits_noise && chosen.noise_variances.is_some() && surface_cloud.id != values_cloud.id {
            let detail =
                "noise_variances belong to the points of cloud; give alpha or noise_variances here as well";
            return Err(Problem::invalid_request("/geometry", detail));
        }
        // Local regressions take no kernel: that of the values is not meant for them.
        let is_local = solver == SolverChoice::Local || request.model == SurfaceModel::Local;
        let has_own = geometry.kernel.is_some() || !inherits_noise;
        let surface_chosen = if is_local && !has_own && has_values {
            Chosen::default()
        } else {
            Chosen {
                kernel: geometry.kernel.or_else(|| chosen.kernel.clone()),
                alpha: if inherits_noise { chosen.alpha } else { geometry.alpha },
                noise_variances: match inherits_noise {
                    true => chosen.noise_variances.clone(),
                    false => geometry.noise_variances,
                },
                ..Chosen::default()
            }
        };
        let values = match has_values {
            true => {
                Some(self.plan(values_cloud, chosen, Way::Dense, duplicates, Purpose::Values, pointers)?)
            }
            false => None,
        };
        let asked = (Purpose::Curvatures, request);
        let surface =
            self.plan_surface(surface_cloud, surface_chosen, solver, duplicates, asked, surface_pointers)?;
        Ok((values, surface))
    }

    /// Queries of the dimension of a fit's cloud; absent, its points. The fits are told where their queries stand.
    ///
    /// # Errors
    /// 413 beyond the limit, 422 for what is no list of points of this dimension.
    pub fn queries(
        &self,
        queries: Option<Points>,
        fits: &mut [&mut PlannedFit],
    ) -> Result<Arc<Cloud>, Problem> {
        // The last fit is that of the surface, whose points are the default.
        let Some(default) = fits.last().map(|fit| (fit.stored.cloud.clone(), fit.pointers.points)) else {
            return Err(Problem::internal());
        };
        let Some(points) = queries else {
            fits.iter_mut().for_each(|fit| fit.pointers.queries = default.1);
            return Ok(default.0);
        };
        let queries = rectangular(points, "/queries", Slug::InvalidRequest)?;
        let (limit, required) = (self.app.config.max_queries, queries.n_points());
        if required > limit {
            return Err(too_many_queries(limit, required).at("/queries"));
        }
        let (expected, found) = (default.0.dimension(), queries.dimension());
        if expected != found {
            return Err(dimension_mismatch("/queries", expected, &queries));
        }
        Ok(Arc::new(queries))
    }

    /// Checks one entry per point of a cloud.
    ///
    /// # Errors
    /// 422 `length-mismatch`.
    pub fn check_values_of(&self, values: &[f64], cloud: &Cloud) -> Result<(), Problem> {
        let found = values.len();
        if cloud.n_points() == found { Ok(()) } else { Err(length_mismatch("/values", cloud, found)) }
    }

    /// Admits an answer of so many numbers, and says how many they are.
    ///
    /// # Errors
    /// 413 `problem-too-large` if it would be over the limit, or not countable.
    pub fn check_answer(&self, n_numbers: Option<usize>) -> Result<usize, Problem> {
        let limit = self.app.config.max_response_bytes;
        let required = n_numbers.and_then(|n| n.checked_mul(BYTES_PER_NUMBER)).unwrap_or(usize::MAX);
        if let Some(n_numbers) = n_numbers.filter(|_| required <= limit) {
            return Ok(n_numbers);
        }
        Err(Problem::too_large(Slug::ProblemTooLarge, "bytes of answer", limit, Some(required)).with_remedy(
            "split the queries over several requests, or ask for fewer members: the factorization is kept for the next one \
             (operators raise the limit by GRAMIAN_MAX_RESPONSE_BYTES)",
        ))
    }

    /// Finds a registered cloud, or registers the points given.
    ///
    /// # Errors
    /// 404 `unknown-cloud`, 413 beyond the limits, 422 for what is no cloud.
    pub fn cloud(&self, cloud: CloudRef, pointer: &str) -> Result<Arc<RegisteredCloud>, Problem> {
        match (cloud.id, cloud.points) {
            (Some(id), None) => {
                if cloud.normals.is_some() {
                    let detail = "normals are given with points, not with an id";
                    return Err(Problem::invalid_request(format!("{pointer}/normals"), detail));
                }
                let found = CloudId::parse(&id).and_then(|id| self.registered(id));
                found.ok_or_else(|| unknown_cloud(&id).at(format!("{pointer}/id")))
            }
            (None, Some(points)) => Ok(self.register(points, cloud.normals, pointer)?.0),
            (Some(_), Some(_)) | (None, None) => {
                Err(Problem::invalid_request(pointer, "exactly one of id and points is needed"))
            }
        }
    }

    /// Validates and registers points; says whether they are new.
    ///
    /// # Errors
    /// 413 beyond the limits, 422 for what is no cloud.
    pub fn register(
        &self,
        points: Points,
        normals: Option<Points>,
        pointer: &str,
    ) -> Result<(Arc<RegisteredCloud>, bool), Problem> {
        let at = format!("{pointer}/points");
        let cloud = rectangular(points, &at, Slug::InvalidCloud)?;
        let (limit, required) = (self.app.config.max_points, cloud.n_points());
        if required > limit {
            return Err(too_many_points(limit, required).at(at));
        }
        let (limit, required) = (self.app.config.max_dimension, cloud.dimension());
        if required > limit {
            return Err(too_many_coordinates(limit, required, cloud.n_points()).at(at));
        }
        let normals = match normals {
            None => None,
            Some(normals) => Some(check_normals(normals, &cloud, &format!("{pointer}/normals"))?),
        };
        let (stored, is_new) = self.app.clouds.register(self.owner, cloud, normals);
        let is_there = stored.is_durable() && stored.is_trusted(TRUST);
        if self.app.durable.is_some() && !is_there {
            self.fresh.borrow_mut().push(stored.clone());
        }
        Ok((stored, is_new))
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

/// What is asked that only a dense factorization has: its word, and where it stands.
#[derive(Debug, Clone, Copy)]
pub struct DenseOnly {
    pub name: &'static str,
    pub pointer: &'static str,
}

impl DenseOnly {
    /// 422 where the local solver is asked for it.
    fn refused_by_local(self) -> Problem {
        let detail = format!(
            "the local solver knows each query by itself and has no {}; leave it out, or take \"solver\": \"dense\"",
            self.name
        );
        Problem::of_field(Slug::UnsupportedBySolver, self.pointer, detail)
    }

    fn remedy(self) -> String {
        format!("leave out {}, which the local solver does not have, or thin the cloud", self.name)
    }
}

const TRY_LOCAL: &str =
    "set \"solver\" to \"local\", which takes time in proportion to the points, or thin the cloud";

/// 422 for operators on values, which are those of one function.
fn local_lacks_operators(pointer: &str) -> Problem {
    let detail = "operators take values of one function, which the local solver does not have: take \"solver\": \"dense\", and \
                  {\"geometry\": {\"surface\": \"local\"}} for the surface under an operator";
    Problem::of_field(Slug::UnsupportedBySolver, pointer, detail)
}

/// What an operator on values is computed from.
pub enum OperatorFits {
    Solved { values: PlannedFit, surface: PlannedFit },
    Stencils { nodes: Arc<RegisteredCloud>, surface: PlannedFit },
}

/// Where the fit of a request stands.
fn pointers_of(fit: &Fit) -> Pointers {
    Pointers {
        points: if fit.cloud.id.is_some() { "/cloud/id" } else { "/cloud/points" },
        regularization: if fit.noise_variances.is_some() { "/noise_variances" } else { "/alpha" },
        ..Pointers::REQUEST
    }
}

/// Where the fit of the surface stands: what `geometry` leaves out, in the request.
fn pointers_of_surface(geometry: &Geometry, request: Pointers) -> Pointers {
    Pointers {
        points: match &geometry.cloud {
            None => request.points,
            Some(cloud) if cloud.id.is_some() => "/geometry/cloud/id",
            Some(_) => "/geometry/cloud/points",
        },
        kernel: if geometry.kernel.is_some() { "/geometry/kernel" } else { request.kernel },
        regularization: match (&geometry.noise_variances, geometry.alpha) {
            (Some(_), _) => "/geometry/noise_variances",
            (None, Some(_)) => "/geometry/alpha",
            (None, None) => request.regularization,
        },
        ..request
    }
}

/// 404 for an id that names no cloud of this owner.
pub fn unknown_cloud(id: &str) -> Problem {
    let shown: String = id.chars().take(64).collect();
    Problem::new(Slug::UnknownCloud, format!("no cloud {shown:?} is registered; post its points again"))
}

/// What the client chose of kernel and regularization, for values or without.
#[derive(Default)]
struct Chosen {
    kernel: Option<Kernel>,
    alpha: Option<f64>,
    noise_variances: Option<Vec<f64>>,
    values: Option<Arc<Vec<f64>>>,
    n_lists: usize,
    mean: Option<Mean>,
}

impl Chosen {
    fn of(fit: Fit) -> Self {
        Self {
            kernel: fit.kernel,
            alpha: fit.alpha,
            noise_variances: fit.noise_variances,
            values: fit.values,
            n_lists: fit.n_lists,
            mean: fit.mean.map(Mean::from),
        }
    }

    /// What is given; `None` leaves it to the service.
    fn regularization(
        self,
        stored: &RegisteredCloud,
        pointers: Pointers,
    ) -> Result<Option<Regularization>, Problem> {
        let refuse = |error| Problem::from_numerics(error, pointers);
        match (self.alpha, self.noise_variances) {
            (Some(_), Some(_)) => {
                let detail = "noise_variances stands instead of alpha; give one of them";
                Err(Problem::invalid_request(pointers.regularization, detail))
            }
            (None, None) => Ok(None),
            (Some(alpha), None) => Regularization::uniform(alpha).map(Some).map_err(refuse),
            (None, Some(variances)) => {
                let found = variances.len();
                if stored.cloud.n_points() != found {
                    return Err(length_mismatch(pointers.regularization, &stored.cloud, found));
                }
                Regularization::per_point(variances).map(Some).map_err(refuse)
            }
        }
    }
}

/// The greatest seed: every client has the whole numbers up to it.
const MAX_SEED: u64 = (1 << 53) - 1;

/// # Errors
/// 422 for a seed that some clients cannot say.
pub fn check_seed(seed: u64, pointer: &str) -> Result<(), Problem> {
    match seed <= MAX_SEED {
        true => Ok(()),
        false => {
            Err(Problem::invalid_request(pointer, format!("a seed is at most {MAX_SEED}, found {seed}")))
        }
    }
}

/// Lists of values of one length, and how many they are.
///
/// # Errors
/// 422 for no list, and for one of another length than the first.
pub fn value_lists(ValueLists(lists): ValueLists) -> Result<(Arc<Vec<f64>>, usize), Problem> {
    if let Some((row, found)) = lists.ragged {
        return Err(Problem::length_mismatch(format!("/values/{row}"), lists.dimension, found));
    }
    match lists.n_rows {
        0 => Err(Problem::invalid_request("/values", "at least one list of values is needed")),
        n_rows => Ok((Arc::new(lists.coordinates), n_rows)),
    }
}

/// Points with rows of one length.
fn rectangular(points: Points, pointer: &str, slug: Slug) -> Result<Cloud, Problem> {
    if let Some((row, found)) = points.ragged {
        let detail =
            format!("point {row} has {found} coordinates, the points before it have {}", points.dimension);
        return Err(Problem::of_field(slug, format!("{pointer}/{row}"), detail));
    }
    Cloud::new(points.coordinates, points.dimension).map_err(|error| {
        let detail = match points.dimension {
            0 => "at least one point with one coordinate is needed".to_owned(),
            _ => error.to_string(),
        };
        let at = match error {
            NumericsError::CoordinateTooLarge { point, coordinate } => {
                format!("{pointer}/{point}/{coordinate}")
            }
            _ => pointer.to_owned(),
        };
        Problem::of_field(slug, at, detail)
    })
}

/// 422 for rows of another dimension than the cloud, with a hint if their columns would have it.
fn dimension_mismatch(pointer: &str, expected: usize, found: &Cloud) -> Problem {
    let problem = Problem::dimension_mismatch(pointer, expected, found.dimension());
    if found.n_points() != expected {
        return problem;
    }
    problem.with_remedy(&transposed(expected, found.dimension()))
}

/// 422 for entries that are not one per point of the cloud, with a hint if they are one per column.
fn length_mismatch(pointer: &str, cloud: &Cloud, found: usize) -> Problem {
    let (n_points, dimension) = (cloud.n_points(), cloud.dimension());
    let problem = Problem::length_mismatch(pointer, n_points, found);
    if found != dimension {
        return problem;
    }
    problem.with_remedy(&format!("of the cloud, {}", transposed(n_points, dimension)))
}

/// One normal per point, of its dimension and not zero.
fn check_normals(normals: Points, cloud: &Cloud, pointer: &str) -> Result<Cloud, Problem> {
    let normals = rectangular(normals, pointer, Slug::InvalidCloud)?;
    let is_transposed = normals.n_points() == cloud.dimension() && normals.dimension() == cloud.n_points();
    if normals.n_points() != cloud.n_points() && !is_transposed {
        return Err(Problem::length_mismatch(pointer, cloud.n_points(), normals.n_points()));
    }
    if normals.dimension() != cloud.dimension() {
        return Err(dimension_mismatch(pointer, cloud.dimension(), &normals));
    }
    let zero = normals.points().position(|normal| normal.iter().all(|&x| x == 0.0));
    match zero {
        None => Ok(normals),
        Some(row) => {
            let detail = format!("normal {row} is zero and points nowhere");
            Err(Problem::of_field(Slug::InvalidCloud, format!("{pointer}/{row}"), detail)
                .with_remedy("leave out this point, or all normals: they are found from the points then"))
        }
    }
}
