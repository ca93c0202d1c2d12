//! What a model says of itself and of a function that it served: the numbers by which an answer is trusted.

use std::sync::Arc;

use crate::patches::PatchKernel;
use crate::solver::trend::Trend;
use crate::solver::{Disagreement, Method, Solution, Solver};
use crate::surface::Surface;

/// Numbers of a model and of the function that it served; absent where the solver has none.
#[derive(Debug, Clone, Default)]
pub struct Report {
    /// How the matrix was factorized.
    pub method: Option<Method>,
    pub rank: Option<usize>,
    pub reciprocal_condition: Option<f64>,
    pub relative_residual: Option<f64>,
    /// `Λᵀ K Λ` for the kernel of the model.
    pub native_norm_squared: Option<f64>,
    /// `|u(X) − Y|₂`, unit of the values; for local regressions the distance of the points from the surface.
    pub misfit: Option<f64>,
    pub is_refined: bool,
    pub trend: Option<Trend>,
    /// How values contradict kernel and noise; points are those that are fitted.
    pub disagreement: Option<Disagreement>,
    /// Points of a neighbourhood.
    pub n_neighbours: usize,
    /// Queries where some neighbours follow from nearer ones to rounding, and were left out.
    pub n_dependent: usize,
    /// By how many deviations answers from half of the neighbours differ, where that is too much.
    pub unsettled: Option<f64>,
    /// Kernel and noise that local regressions chose.
    pub regressions: Option<Regressions>,
}

/// Kernel and noise of the heights of local regressions.
#[derive(Debug, Clone, Copy)]
pub struct Regressions {
    pub kernel: PatchKernel,
    /// Standard deviation of the points across the surface, unit L.
    pub noise: f64,
}

impl Report {
    /// The report of a solver with one function; kernel and noise are `scale` times those of the solver.
    pub fn of_function(solver: &Solver, solution: &Arc<Solution>, scale: f64) -> Self {
        Self {
            method: Some(solver.method()),
            rank: Some(solver.rank()),
            reciprocal_condition: Some(solver.reciprocal_condition()),
            relative_residual: Some(solution.relative_residual),
            native_norm_squared: Some(solution.native_norm_squared),
            misfit: Some(solution.misfit),
            is_refined: solution.refined,
            trend: solution.trend.clone(),
            disagreement: solution.disagreement(solver.n_points(), scale),
            ..Self::default()
        }
    }

    /// The report of a surface: of its signature function, or of the regressions.
    pub fn of_surface(surface: &Surface) -> Self {
        match surface {
            Surface::Signature(surface) => {
                let signature = surface.signature();
                Self::of_function(&signature.solver, &signature.solution, 1.0)
            }
            Surface::Local(surface) => {
                let (kernel, noise) = (surface.patches().kernel(), surface.patches().noise());
                Self {
                    misfit: Some(surface.misfit()),
                    regressions: Some(Regressions { kernel, noise }),
                    ..Self::default()
                }
            }
        }
    }
}
