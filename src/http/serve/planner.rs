//! From the shared objects of a request to validated inputs of the numerics.

use std::sync::Arc;

use super::plan::PlannedFit;
use crate::http::fields::{CloudRef, DuplicatePolicy, Fit, Geometry, Kernel, SolverChoice};
use crate::http::problem::slug::Slug;
use crate::http::problem::{Pointers, Problem};
use crate::http::serve::app::App;
use crate::http::wire::read::limits::{too_many_coordinates, too_many_points, too_many_queries, transposed};
use crate::http::wire::read::points::Points;
use crate::numerics::defaults::Purpose;
use crate::numerics::error::NumericsError;
use crate::numerics::points::cloud::Cloud;
use crate::numerics::sums::regularization::Regularization;
use crate::store::Owner;
use crate::store::clouds::RegisteredCloud;
use crate::store::key::CloudId;

/// Bytes that a number takes in JSON at most, with its comma.
const BYTES_PER_NUMBER: usize = 25;

/// Validates the parts of a request against the limits and the stored clouds.
pub struct Planner<'a> {
    pub app: &'a App,
    pub owner: Owner,
}

impl Planner<'_> {
    /// Checks the fit of a request.
    ///
    /// # Errors
    /// A [`Problem`] with a pointer to the field.
    pub fn fit(&self, fit: Fit, purpose: Purpose) -> Result<PlannedFit, Problem> {
        let pointers = pointers_of(&fit);
        let stored = self.cloud(fit.cloud, "/cloud")?;
        let (SolverChoice::Auto | SolverChoice::Dense) = fit.solver;
        let chosen = Chosen { kernel: fit.kernel, alpha: fit.alpha, noise_variances: fit.noise_variances };
        self.plan(stored, chosen, fit.duplicates, purpose, pointers)
    }

    /// Checks the fits of values and of the surface that they live on; what `geometry` leaves out is as in the request.
    ///
    /// # Errors
    /// A [`Problem`] with a pointer to the field.
    pub fn fits(&self, fit: Fit, geometry: Option<Geometry>) -> Result<(PlannedFit, PlannedFit), Problem> {
        let geometry = geometry.unwrap_or_default();
        let pointers = pointers_of(&fit);
        let surface_pointers = pointers_of_surface(&geometry, pointers);
        let values_cloud = self.cloud(fit.cloud, "/cloud")?;
        let surface_cloud = match geometry.cloud {
            None => values_cloud.clone(),
            Some(cloud) => self.cloud(cloud, "/geometry/cloud")?,
        };
        let (expected, found) = (values_cloud.cloud.dimension(), surface_cloud.cloud.dimension());
        if expected != found {
            return Err(Problem::dimension_mismatch("/geometry/cloud", expected, found));
        }
        let (SolverChoice::Auto | SolverChoice::Dense) = geometry.solver.unwrap_or(fit.solver);
        let chosen = Chosen { kernel: fit.kernel, alpha: fit.alpha, noise_variances: fit.noise_variances };
        let inherits_noise = geometry.alpha.is_none() && geometry.noise_variances.is_none();
        if inherits_noise && chosen.noise_variances.is_some() && surface_cloud.id != values_cloud.id {
            let detail =
                "noise_variances belong to the points of cloud; give alpha or noise_variances here as well";
            return Err(Problem::invalid_request("/geometry", detail));
        }
        let surface_chosen = Chosen {
            kernel: geometry.kernel.or_else(|| chosen.kernel.clone()),
            alpha: if inherits_noise { chosen.alpha } else { geometry.alpha },
            noise_variances: match inherits_noise {
                true => chosen.noise_variances.clone(),
                false => geometry.noise_variances,
            },
        };
        let values = self.plan(values_cloud, chosen, fit.duplicates, Purpose::Values, pointers)?;
        let surface =
            self.plan(surface_cloud, surface_chosen, fit.duplicates, Purpose::Curvatures, surface_pointers)?;
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

    /// Checks one entry per point of the cloud.
    ///
    /// # Errors
    /// 422 `length-mismatch`.
    pub fn check_values(&self, values: &[f64], plan: &PlannedFit) -> Result<(), Problem> {
        let (cloud, found) = (&plan.stored.cloud, values.len());
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
                let found = CloudId::parse(&id).and_then(|id| self.app.clouds.get(self.owner, id));
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
        Ok(self.app.clouds.register(self.owner, cloud, normals))
    }

    fn plan(
        &self,
        stored: Arc<RegisteredCloud>,
        chosen: Chosen,
        duplicates: DuplicatePolicy,
        purpose: Purpose,
        pointers: Pointers,
    ) -> Result<PlannedFit, Problem> {
        let kernel = chosen.kernel.as_ref().map(|kernel| kernel.plan(pointers)).transpose()?;
        let regularization = chosen.regularization(&stored, pointers)?;
        Ok(PlannedFit { owner: self.owner, stored, pointers, kernel, regularization, duplicates, purpose })
    }
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

/// What the client chose of kernel and regularization.
struct Chosen {
    kernel: Option<Kernel>,
    alpha: Option<f64>,
    noise_variances: Option<Vec<f64>>,
}

impl Chosen {
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
            Err(Problem::of_field(Slug::InvalidCloud, format!("{pointer}/{row}"), detail))
        }
    }
}
