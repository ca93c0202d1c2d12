//! Quality numbers of a model and of a function that it served. They show how far to trust an answer.

use std::sync::Arc;

use crate::regression::solver::trend::Trend;
use crate::regression::solver::{Disagreement, Method, Remaining, Solution, Solver};
use crate::surface::Surface;
use crate::surface::local::SurfaceHyperparameters;

/// Quality numbers of a model and of the function that it served. Absent where the solver has none.
#[derive(Debug, Clone, Default)]
pub struct Report {
    /// Method by which the matrix was factorized.
    pub method: Option<Method>,
    pub rank: Option<usize>,
    /// What landmarks leave of the diagonal.
    pub remaining: Option<Remaining>,
    pub reciprocal_condition: Option<f64>,
    pub relative_residual: Option<f64>,
    /// `Λᵀ K Λ` with the kernel of the model.
    pub native_norm_squared: Option<f64>,
    /// `|u(X) − Y|₂`, unit V. For local regressions, the distance of the points from the surface.
    pub misfit: Option<f64>,
    pub is_refined: bool,
    /// Number of iterations, if the solver iterates, and the residual that it was to reach.
    pub n_iterations: Option<usize>,
    pub tolerance: Option<f64>,
    pub trend: Option<Trend>,
    /// Disagreement of the values with kernel and noise. Points are those of the fit.
    pub disagreement: Option<Disagreement>,
    /// Number of points in a neighbourhood.
    pub n_neighbours: usize,
    /// Number of queries where neighbours were left out, because they follow from nearer ones up to rounding.
    pub n_dependent: usize,
    /// Difference from answers by half of the neighbours, in deviations. `None` unless it is too large.
    pub unsettled: Option<f64>,
    /// What local regressions learned, or were given.
    pub hyperparameters: Option<SurfaceHyperparameters>,
    /// Number of positions around a point on which answers of local regressions depend.
    pub reach: Option<usize>,
}

impl Report {
    /// Returns the report of a solver with one function. Kernel and noise are `scale` times those of the
    /// solver.
    pub fn of_function(solver: &Solver, solution: &Arc<Solution>, scale: f64) -> Self {
        Self {
            method: Some(solver.method()),
            rank: Some(solver.rank()),
            remaining: solver.remaining_diagonal(),
            reciprocal_condition: solver.reciprocal_condition(),
            relative_residual: Some(solution.relative_residual),
            native_norm_squared: Some(solution.native_norm_squared),
            misfit: Some(solution.misfit),
            is_refined: solution.refined,
            n_iterations: solution.n_iterations,
            tolerance: solver.tolerance(),
            trend: solution.trend.clone(),
            disagreement: solution.disagreement(solver.n_points(), scale),
            ..Self::default()
        }
    }

    /// Returns the report of a surface: of its signature function, or of its local regressions.
    pub fn of_surface(surface: &Surface) -> Self {
        match surface {
            Surface::Signature(surface) => {
                let signature = surface.signature();
                Self::of_function(&signature.solver, &signature.solution, 1.0)
            }
            Surface::Local(surface) => Self {
                misfit: Some(surface.misfit()),
                hyperparameters: Some(surface.hyperparameters()),
                reach: Some(surface.reach()),
                ..Self::default()
            },
        }
    }
}
