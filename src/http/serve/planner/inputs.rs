//! Clouds, queries, values and normals of a request: their checks and refusals.

use std::cmp::Ordering;
use std::sync::Arc;

use super::Planner;
use crate::http::fields::CloudInput;
use crate::http::fields::limits::{too_many_coordinates, too_many_points, too_many_queries, transposed};
use crate::http::problem::{self, Problem, catalogue};
use crate::http::serve::durable::TRUST;
use crate::http::serve::plan::FittedCloud;
use crate::http::state::app::App;
use crate::store::clouds::RegisteredCloud;
use crate::store::key::CloudId;
use gramian_host::problem::slug::Slug;
use gramian_host::wire::read::points::{Points, ValueLists};
use gramian_numerics::error::NumericsError;
use gramian_numerics::points::cloud::Cloud;

/// Largest number of bytes of a number in JSON, with its comma.
const BYTES_PER_NUMBER: usize = 25;
impl Planner<'_> {
    /// Returns the queries, which have the dimension of the fit's cloud. Without queries, these are its
    /// points.
    ///
    /// The pointer of the fit to its queries is set.
    ///
    /// # Errors
    /// 413 beyond the limit. 422 for queries that are no list of points of this dimension.
    pub fn queries(&self, queries: Option<Points>, of: &mut FittedCloud) -> Result<Arc<Cloud>, Problem> {
        let Some(points) = queries else {
            of.pointers.queries = of.pointers.points;
            return Ok(of.stored.cloud.clone());
        };
        let queries = rectangular(points, "/queries", catalogue::INVALID_REQUEST)?;
        let (limit, required) = (self.app.config.max_queries, queries.n_points());
        if required > limit {
            return Err(too_many_queries(limit, required).at("/queries"));
        }
        let (expected, found) = (of.stored.cloud.dimension(), queries.dimension());
        if expected != found {
            return Err(dimension_mismatch("/queries", expected, &queries));
        }
        Ok(Arc::new(queries))
    }

    /// Returns the sites, which are points of the cloud. Its surface is learned at these points alone.
    ///
    /// # Errors
    /// 422 for sites that are no list of points of the cloud.
    pub(super) fn sites(&self, sites: Points, cloud: &Cloud) -> Result<Arc<Cloud>, Problem> {
        let sites = rectangular(sites, "/sites", catalogue::INVALID_REQUEST)?;
        if cloud.dimension() != sites.dimension() {
            return Err(dimension_mismatch("/sites", cloud.dimension(), &sites));
        }
        if let Some(site) = first_elsewhere(&sites, cloud) {
            let detail = format!("site {site} is not a point of the cloud");
            return Err(Problem::invalid_request(format!("/sites/{site}"), detail));
        }
        Ok(Arc::new(sites))
    }

    /// Checks that there is one value per point of a cloud.
    ///
    /// # Errors
    /// 422 `length-mismatch`.
    pub fn check_values_of(&self, values: &[f64], cloud: &Cloud) -> Result<(), Problem> {
        let found = values.len();
        if cloud.n_points() == found { Ok(()) } else { Err(length_mismatch("/values", cloud, found)) }
    }

    /// Admits an answer of `n_numbers` numbers, and returns that count.
    ///
    /// # Errors
    /// 413 `problem-too-large` if the answer would exceed the limit, or cannot be counted.
    pub fn check_answer(&self, n_numbers: Option<usize>) -> Result<usize, Problem> {
        let limit = self.app.config.max_response_bytes;
        let required = n_numbers.and_then(|n| n.checked_mul(BYTES_PER_NUMBER)).unwrap_or(usize::MAX);
        if let Some(n_numbers) = n_numbers.filter(|_| required <= limit) {
            return Ok(n_numbers);
        }
        Err(Problem::too_large(catalogue::PROBLEM_TOO_LARGE, "bytes of answer", limit, Some(required)).with_remedy(
            "split the queries over several requests, or ask for fewer members: the cached factorization serves all of them \
             (operators raise the limit by GRAMIAN_MAX_RESPONSE_BYTES)",
        ))
    }

    /// Finds a registered cloud, or registers the points given.
    ///
    /// # Errors
    /// 404 `unknown-cloud`, 413 beyond the limits, 422 for an invalid cloud.
    pub fn cloud(&self, cloud: CloudInput, pointer: &str) -> Result<Arc<RegisteredCloud>, Problem> {
        if let Some(registered) = cloud.registered {
            return Ok(registered);
        }
        match (cloud.id, cloud.points) {
            (Some(id), None) => {
                if cloud.normals.is_some() {
                    let detail = "normals can only be given with points, not with an id";
                    return Err(Problem::invalid_request(format!("{pointer}/normals"), detail));
                }
                let found = CloudId::parse(&id).and_then(|id| self.registered(id));
                found.ok_or_else(|| unknown_cloud(&id).at(format!("{pointer}/id")))
            }
            (None, Some(points)) => Ok(self.register(points, cloud.normals, pointer)?.0),
            (Some(_), Some(_)) | (None, None) => {
                Err(Problem::invalid_request(pointer, "give exactly one of id and points"))
            }
        }
    }

    /// Validates and registers points. Returns whether they are new.
    ///
    /// # Errors
    /// 413 beyond the limits, 422 for an invalid cloud.
    pub fn register(
        &self,
        points: Points,
        normals: Option<Points>,
        pointer: &str,
    ) -> Result<(Arc<RegisteredCloud>, bool), Problem> {
        let cloud = unregistered(self.app, points, &format!("{pointer}/points"))?;
        let normals = match normals {
            None => None,
            Some(normals) => Some(check_normals(normals, &cloud, &format!("{pointer}/normals"))?),
        };
        let (stored, is_new) = self.app.clouds.register(self.owner, cloud, normals);
        let is_there = stored.is_stored() && stored.is_trusted(TRUST);
        if self.app.durable.is_some() && !is_there {
            self.known.fresh.borrow_mut().push(stored.clone());
        }
        Ok((stored, is_new))
    }
}

/// Validates points that are used once, at this pointer.
///
/// # Errors
/// 413 beyond the limits, 422 for an invalid cloud.
pub fn unregistered(app: &App, points: Points, pointer: &str) -> Result<Cloud, Problem> {
    let cloud = rectangular(points, pointer, catalogue::INVALID_CLOUD)?;
    let (limit, required) = (app.config.max_points, cloud.n_points());
    if required > limit {
        return Err(too_many_points(limit, required).at(pointer));
    }
    let (limit, required) = (app.config.max_dimension, cloud.dimension());
    if required > limit {
        return Err(too_many_coordinates(limit, required, cloud.n_points()).at(pointer));
    }
    Ok(cloud)
}

/// Finds the first site that is not a point of the cloud.
fn first_elsewhere(sites: &Cloud, cloud: &Cloud) -> Option<usize> {
    let mut order: Vec<usize> = (0..sites.n_points()).collect();
    // All coordinates are finite.
    let along = |site: usize, x: &[f64]| sites.point(site).partial_cmp(x).unwrap_or(Ordering::Equal);
    order.sort_by(|&a, &b| along(a, sites.point(b)));
    // Sites that coincide are looked for once. The first of them comes first.
    order.dedup_by(|later, first| along(*later, sites.point(*first)).is_eq());
    let mut is_there = vec![false; order.len()];
    for x in cloud.points() {
        let at = order.partition_point(|&site| along(site, x).is_lt());
        if order.get(at).is_some_and(|&site| along(site, x).is_eq()) {
            is_there[at] = true;
        }
    }
    order.into_iter().zip(is_there).filter(|(_, is_there)| !is_there).map(|(site, _)| site).min()
}

/// Returns 404 for an id that names no cloud of this owner.
pub fn unknown_cloud(id: &str) -> Problem {
    let shown: String = id.chars().take(64).collect();
    Problem::new(catalogue::UNKNOWN_CLOUD, format!("no cloud {shown:?} is registered; post its points again"))
}

/// Largest seed. JSON clients represent all whole numbers up to it.
const MAX_SEED: u64 = (1 << 53) - 1;

/// Checks that a seed is at most `MAX_SEED`.
///
/// # Errors
/// 422 for a seed that some clients cannot represent.
pub fn check_seed(seed: u64, pointer: &str) -> Result<(), Problem> {
    if seed <= MAX_SEED {
        Ok(())
    } else {
        Err(Problem::invalid_request(pointer, format!("a seed is at most {MAX_SEED}, found {seed}")))
    }
}

/// Values of a request, one for each point of its cloud.
pub struct GivenValues {
    pub list: Vec<f64>,
    /// Number k of lists, or `None` for values without lists.
    pub n_lists: Option<usize>,
}

impl GivenValues {
    pub fn one(list: Vec<f64>) -> Self {
        Self { list, n_lists: None }
    }
}

/// Returns the lists of values, which have the same length.
///
/// # Errors
/// 422 without any list, and for a list of another length than the first.
pub fn value_lists(ValueLists(lists): ValueLists) -> Result<GivenValues, Problem> {
    if let Some((row, found)) = lists.ragged {
        return Err(problem::length_mismatch(format!("/values/{row}"), lists.dimension, found));
    }
    match lists.n_rows {
        0 => Err(Problem::invalid_request("/values", "at least one list of values is needed")),
        n_rows => Ok(GivenValues { list: lists.coordinates, n_lists: Some(n_rows) }),
    }
}

/// Returns the cloud of points whose rows have the same length.
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

/// Returns 422 for rows of another dimension than the cloud, with a hint if the transpose would fit.
fn dimension_mismatch(pointer: &str, expected: usize, found: &Cloud) -> Problem {
    let problem = problem::dimension_mismatch(pointer, expected, found.dimension());
    if found.n_points() != expected {
        return problem;
    }
    problem.with_remedy(&transposed(expected, found.dimension()))
}

/// Returns 422 for entries that are not one per point of the cloud, with a hint if they are one per column.
pub(super) fn length_mismatch(pointer: &str, cloud: &Cloud, found: usize) -> Problem {
    let (n_points, dimension) = (cloud.n_points(), cloud.dimension());
    let problem = problem::length_mismatch(pointer, n_points, found);
    if found != dimension {
        return problem;
    }
    problem.with_remedy(&format!("of the cloud, {}", transposed(n_points, dimension)))
}

/// Checks that there is one normal per point, of its dimension and not zero.
fn check_normals(normals: Points, cloud: &Cloud, pointer: &str) -> Result<Cloud, Problem> {
    let normals = rectangular(normals, pointer, catalogue::INVALID_CLOUD)?;
    let is_transposed = normals.n_points() == cloud.dimension() && normals.dimension() == cloud.n_points();
    if normals.n_points() != cloud.n_points() && !is_transposed {
        return Err(problem::length_mismatch(pointer, cloud.n_points(), normals.n_points()));
    }
    if normals.dimension() != cloud.dimension() {
        return Err(dimension_mismatch(pointer, cloud.dimension(), &normals));
    }
    let zero = normals.points().position(|normal| normal.iter().all(|&x| x == 0.0));
    match zero {
        None => Ok(normals),
        Some(row) => {
            let detail = format!("normal {row} is zero");
            Err(Problem::of_field(catalogue::INVALID_CLOUD, format!("{pointer}/{row}"), detail).with_remedy(
                "leave out this point, or leave out all normals and they are estimated from the points",
            ))
        }
    }
}
