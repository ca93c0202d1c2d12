//! Choice of kernel, regularization and solver in a request, and refusals of combinations that do not work.

use super::inputs::length_mismatch;
use crate::http::fields::{CloudInput, Fit, Hyperparameters, Kernel, SolverChoice, Surface};
use crate::http::problem::{Pointers, Problem};
use crate::http::problem::{catalogue, from_numerics};
use crate::http::serve::plan::FittedCloud;
use gramian_host::wire::read::points::Points;
use gramian_numerics::error::SolverKind;
use gramian_numerics::patches::MAX_LOCAL_DIMENSION;
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::regression::solver::{DEFAULT_TOLERANCE, TOLERANCES};
use gramian_numerics::regression::sums::regularization::Regularization;

/// A requested quantity that not every solver provides: its name, the pointer to it, and the solvers without.
#[derive(Debug, Clone, Copy)]
pub struct RestrictedQuantity {
    pub name: &'static str,
    pub pointer: &'static str,
    pub without: &'static [SolverKind],
}

impl RestrictedQuantity {
    /// Returns 422 where the request asks a solver for this quantity that does not provide it.
    pub(super) fn refused_by(self, solver: SolverKind) -> Problem {
        let why = match solver {
            SolverKind::Local => "the local solver treats each query separately",
            SolverKind::Iterative => "the iterative solver has weights for given values alone",
            SolverKind::Landmark => "landmarks stand for all points",
            SolverKind::Dense => "the dense solver takes all points at once",
        };
        let name = self.name;
        let detail = format!("{why}, so it has no {name}; leave it out, or set \"solver\": \"dense\"");
        Problem::of_field(catalogue::UNSUPPORTED_BY_SOLVER, self.pointer, detail)
    }

    /// The remedy where `auto` would take this solver.
    pub(super) fn remedy(self, solver: SolverKind) -> String {
        let solver: &str = solver.into();
        format!("leave out {}, which the {solver} solver cannot compute, or thin the cloud", self.name)
    }
}

pub(super) const TRY_LOCAL: &str =
    "set \"solver\" to \"local\", which takes time in proportion to the points, or thin the cloud";

/// Returns 422 for dense matrices of operators with the local solver. They need one function for all queries.
pub(super) fn local_lacks_operators(pointer: &str) -> Problem {
    let detail = "a dense matrix needs one function of all values, which the local solver does not have: set \"solver\": \
                  \"dense\", with \"surface\": {\"model\": \"regression\"} for a local surface, or ask for the sparse matrix at \
                  /v1/laplace-beltrami/sparse-matrix or /v1/surface-gradient/sparse-matrix";
    Problem::of_field(catalogue::UNSUPPORTED_BY_SOLVER, pointer, detail)
}

/// Returns 422 for what only local regressions have, at the surface of another solver.
pub(super) fn only_local_learns(member: &str) -> Problem {
    let detail =
        format!("only local regressions take {member}: leave them out, or set \"solver\": \"local\"");
    Problem::of_field(catalogue::UNSUPPORTED_BY_SOLVER, format!("/{member}"), detail)
}

/// Returns 422 for the normals of edges at the surface of another solver.
pub(super) fn only_local_finds_edges() -> Problem {
    let detail = format!(
        "only local regressions, in dimensions 2 to {MAX_LOCAL_DIMENSION}, find the normals of both sides of an edge: leave \
         out edge_normals, or set \"solver\": \"local\" without kernel and noise"
    );
    Problem::of_field(catalogue::UNSUPPORTED_BY_SOLVER, "/include", detail)
}

/// Returns the tolerance of a request.
///
/// # Errors
/// Returns 422 for one that is out of range, or where another solver is requested, which has none.
pub(super) fn checked_tolerance(fit: &Fit) -> Result<f64, Problem> {
    let refused = |detail: String| Err(Problem::invalid_request("/tolerance", detail));
    match (fit.tolerance, fit.solver) {
        (None, _) => Ok(DEFAULT_TOLERANCE),
        (Some(_), SolverChoice::Dense | SolverChoice::Landmark | SolverChoice::Local) => {
            refused("only the solver iterative has a tolerance".to_owned())
        }
        (Some(tolerance), SolverChoice::Auto | SolverChoice::Iterative) => {
            let (least, most) = (TOLERANCES.start(), TOLERANCES.end());
            if TOLERANCES.contains(&tolerance) {
                Ok(tolerance)
            } else {
                refused(format!("a tolerance lies between {least:e} and {most:e}, not at {tolerance:e}"))
            }
        }
    }
}

/// Returns the pointers to the fit of a request.
pub(super) fn pointers_of(cloud: &CloudInput, has_noise_variances: bool) -> Pointers {
    Pointers {
        points: if cloud.id.is_some() { "/cloud/id" } else { "/cloud/points" },
        regularization: if has_noise_variances { "/noise_variances" } else { "/alpha" },
        ..Pointers::REQUEST
    }
}

/// Returns the pointers to the fit of the surface. Fields that `surface` leaves out are those of the
/// request.
pub(super) fn pointers_of_surface(surface: &Surface, request: Pointers) -> Pointers {
    Pointers {
        points: match &surface.cloud {
            None => request.points,
            Some(cloud) if cloud.id.is_some() => "/surface/cloud/id",
            Some(_) => "/surface/cloud/points",
        },
        kernel: if surface.kernel.is_some() { "/surface/kernel" } else { request.kernel },
        regularization: match (&surface.noise_variances, surface.alpha) {
            (Some(_), _) => "/surface/noise_variances",
            (None, Some(_)) => "/surface/alpha",
            (None, None) => request.regularization,
        },
        surface_model: "/surface/model",
        ..request
    }
}

/// Options of a fit that the client chose: kernel, regularization, mean and solver.
#[derive(Default, Clone)]
pub(super) struct FitOptions {
    pub(super) kernel: Option<Kernel>,
    pub(super) alpha: Option<f64>,
    pub(super) noise_variances: Option<Vec<f64>>,
    pub(super) solver: SolverChoice,
    pub(super) mean: Option<Mean>,
    pub(super) sites: Option<Points>,
    pub(super) hyperparameters: Option<Hyperparameters>,
}

impl FitOptions {
    pub(super) fn of(fit: Fit) -> Self {
        Self {
            kernel: fit.kernel,
            alpha: fit.alpha,
            noise_variances: fit.noise_variances,
            solver: fit.solver,
            mean: fit.mean.map(Mean::from),
            sites: fit.sites,
            hyperparameters: fit.hyperparameters,
        }
    }

    /// Returns the pointer to kernel or noise, if one of them is given.
    pub(super) fn given_process(&self, pointers: Pointers) -> Option<&'static str> {
        if self.kernel.is_some() {
            return Some(pointers.kernel);
        }
        let has_noise = self.alpha.is_some() || self.noise_variances.is_some();
        has_noise.then_some(pointers.regularization)
    }

    /// Returns the given regularization. `None` leaves the choice to the service.
    pub(super) fn regularization(self, on: &FittedCloud) -> Result<Option<Regularization>, Problem> {
        let refuse = |error| from_numerics(error, on.pointers);
        match (self.alpha, self.noise_variances) {
            (Some(_), Some(_)) => {
                let detail = "alpha and noise_variances exclude each other; give one of them";
                Err(Problem::invalid_request(on.pointers.regularization, detail))
            }
            (None, None) => Ok(None),
            (Some(alpha), None) => Regularization::uniform(alpha).map(Some).map_err(refuse),
            (None, Some(variances)) => {
                let found = variances.len();
                if on.n_points() != found {
                    return Err(length_mismatch(on.pointers.regularization, &on.stored.cloud, found));
                }
                Regularization::per_point(variances).map(Some).map_err(refuse)
            }
        }
    }
}
