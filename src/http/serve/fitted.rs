//! A plan with its factorization: weights, signature functions and diagnostics.

use std::borrow::Cow;
use std::sync::Arc;

use super::plan::FitPlan;
use crate::http::compute::JobObserver;
use crate::http::fields::{
    Degenerate, DegenerateReason, Diagnostics, FactorizationUsed, SolverUsed, SurfaceUsed, Warning,
    WarningCode,
};
use crate::http::problem::Problem;
use crate::http::serve::app::App;
use crate::http::wire::write::array::Array;
use crate::numerics::error::NumericsError;
use crate::numerics::function::interpolant::Interpolant;
use crate::numerics::kernel::Family;
use crate::numerics::points::cloud::Cloud;
use crate::numerics::solver::{Method, Solution};
use crate::numerics::sums::regularization::Regularization;
use crate::numerics::surface::Surface;
use crate::numerics::surface::degeneracy::{Degeneracy, DegeneracyReason};
use crate::numerics::surface::geometry::{Geometry, GeometryRequest, Orientation};
use crate::store::key::ValuesKey;
use crate::store::prepared::PreparedFit;

/// Below this reciprocal condition fewer than three digits of the weights are sure.
const ILL_CONDITIONED: f64 = 1e-13;

/// The fits of one request.
pub struct Fits {
    pub app: Arc<App>,
    pub main: Fitted,
    /// Present if it differs from the main one.
    pub surface: Option<Fitted>,
    /// The surface, of operations that ask about one.
    pub made: Option<Arc<Surface>>,
}

impl Fits {
    /// The fit of the surface.
    pub fn surface(&self) -> &Fitted {
        self.surface.as_ref().unwrap_or(&self.main)
    }

    /// The function with these values, one per point of the request's cloud.
    ///
    /// # Errors
    /// Those of [`Solution::of`] as a [`Problem`].
    pub fn interpolant(&self, values: &[f64], observer: &JobObserver) -> Result<Interpolant, Problem> {
        self.main.interpolant(&self.app, values, observer)
    }

    /// The geometry of the surface at queries.
    ///
    /// # Errors
    /// Those of [`Geometry::of`] as a [`Problem`].
    pub fn geometry(
        &self,
        queries: &Cloud,
        request: &GeometryRequest,
        observer: &JobObserver,
    ) -> Result<SurfaceGeometry, Problem> {
        let fitted = self.surface();
        let surface = self.made.clone().ok_or_else(Problem::internal)?;
        let geometry =
            Geometry::of(&surface, queries, request, observer).map_err(|error| fitted.refused(error))?;
        Ok(SurfaceGeometry { surface, geometry, orientation: request.orientation })
    }
}

/// A surface with its geometry at the queries of a request.
pub struct SurfaceGeometry {
    pub surface: Arc<Surface>,
    pub geometry: Geometry,
    orientation: Orientation,
}

/// A fit with its factorization.
pub struct Fitted {
    pub plan: FitPlan,
    pub stored: Arc<PreparedFit>,
}

impl Fitted {
    /// A refusal of the numerics, with pointers into this fit.
    pub fn refused(&self, error: NumericsError) -> Problem {
        self.plan.refused(error)
    }

    /// Finds the weights of values that were solved before, or solves.
    fn interpolant(&self, app: &App, values: &[f64], observer: &JobObserver) -> Result<Interpolant, Problem> {
        let solver = self.stored.solver().clone();
        let key = ValuesKey::of(values);
        if let Some(solution) = app.prepared.solution(self.plan.key, key) {
            return Ok(Interpolant { solver, solution });
        }
        let interpolant =
            Interpolant::fit(solver, &self.merged(values), observer).map_err(|error| self.refused(error))?;
        app.prepared.keep_solution(self.plan.key, key, interpolant.solution.clone());
        Ok(interpolant)
    }

    /// Values at the points that are factorized: means over merged duplicates.
    pub fn merged<'a>(&self, values: &'a [f64]) -> Cow<'a, [f64]> {
        match &self.plan.merge {
            None => Cow::Borrowed(values),
            Some(merge) => Cow::Owned(merge.mean(values)),
        }
    }

    /// A matrix of this fit with one column per point of the client's cloud.
    pub fn unmerge(&self, matrix: Vec<f64>) -> Vec<f64> {
        match &self.plan.merge {
            None => matrix,
            Some(merge) => merge.spread(&matrix),
        }
    }

    /// What the answer says of this fit.
    pub fn diagnostics(&self, solution: &Solution, n_queries: usize) -> Diagnostics {
        let (plan, solver) = (&self.plan, self.stored.solver());
        let n_merged = plan.merge.as_ref().map_or(0, |merge| merge.n_merged());
        let mut warnings = Vec::new();
        let mut warn = |code, detail| warnings.push(Warning { code, detail });
        let reciprocal_condition = solver.reciprocal_condition();
        if solver.method() == Method::PivotedCholesky {
            let (rank, n) = (solver.rank(), solver.n_points());
            let detail = format!(
                "Cholesky fails in float64; least squares on {rank} of {n} points, which span the rest to rounding"
            );
            warn(WarningCode::IllConditioned, detail);
        } else if reciprocal_condition < ILL_CONDITIONED {
            let detail = format!("the reciprocal condition is {reciprocal_condition:.1e}");
            warn(WarningCode::IllConditioned, detail);
        }
        if solution.refined {
            let detail = format!("refined to a relative residual of {:.1e}", solution.relative_residual);
            warn(WarningCode::Refined, detail);
        }
        if n_merged > 0 {
            warn(WarningCode::DuplicatesMerged, format!("points merged into an earlier one: {n_merged}"));
        }
        Diagnostics {
            cloud_id: plan.stored.id.to_string(),
            n_points: plan.stored.cloud.n_points(),
            n_queries,
            dimension: plan.stored.cloud.dimension(),
            kernel: (&plan.kernel).into(),
            alpha: match plan.regularization {
                Regularization::Uniform(alpha) => Some(alpha),
                Regularization::PerPoint(_) => None,
            },
            solver: SolverUsed::Dense,
            factorization: match solver.method() {
                Method::Cholesky => FactorizationUsed::Cholesky,
                Method::PivotedCholesky => FactorizationUsed::PivotedCholesky,
            },
            rank: solver.rank(),
            reciprocal_condition,
            relative_residual: solution.relative_residual,
            native_norm_squared: solution.native_norm_squared,
            misfit: solution.misfit,
            n_merged_duplicates: n_merged,
            warnings,
            geometry: None,
        }
    }
}

impl SurfaceGeometry {
    /// The queries without answer or with a flag.
    pub fn degenerate(&self) -> Vec<Degenerate> {
        let entry = |d: &Degeneracy| Degenerate {
            query: d.query,
            reason: match d.reason {
                DegeneracyReason::VanishingGradient => DegenerateReason::VanishingGradient,
                DegeneracyReason::UnaffordableRescue => DegenerateReason::UnaffordableRescue,
                DegeneracyReason::KernelTooRough => DegenerateReason::KernelTooRough,
                DegeneracyReason::FarFromCloud => DegenerateReason::FarFromCloud,
                DegeneracyReason::UnderResolved => DegenerateReason::UnderResolved,
            },
            gradient_norm: d.gradient_norm,
        };
        self.geometry.degenerate().iter().map(entry).collect()
    }

    /// Numbers per query, null where there is no answer.
    pub fn per_query(&self, data: Vec<f64>, shape: &[usize]) -> Array {
        Array::new(data, shape).with_nulls(0, self.geometry.is_null())
    }

    /// The function that serves each query.
    pub fn surfaces(&self) -> Vec<SurfaceUsed> {
        let used =
            |query| if self.geometry.is_offset(query) { SurfaceUsed::Offset } else { SurfaceUsed::Signature };
        (0..self.geometry.n_queries()).map(used).collect()
    }

    /// What the answer says of the fit of this surface.
    pub fn diagnostics(&self, fits: &Fits) -> Diagnostics {
        let solution = &self.surface.signature().solution;
        let mut diagnostics = fits.surface().diagnostics(solution, self.geometry.n_queries());
        diagnostics.warnings.extend(self.warnings());
        diagnostics
    }

    /// What was changed, and what the flags of single queries amount to.
    fn warnings(&self) -> Vec<Warning> {
        let (m, n) = (self.geometry.n_queries(), self.surface.cloud().n_points());
        let flagged =
            |reason| self.geometry.degenerate().iter().filter(|entry| entry.reason == reason).count();
        let n_offset = (0..m).filter(|&query| self.geometry.is_offset(query)).count();
        let orientation = self.surface.orientation();
        let too_rough = match self.surface.signature().solver.kernel().family() {
            Family::Laplace { .. } => LAPLACE_TOO_ROUGH,
            _ => KERNEL_TOO_ROUGH,
        };
        let counted = [
            (n_offset, WarningCode::OffsetModelUsed, "served by the offset model"),
            (flagged(DegeneracyReason::KernelTooRough), WarningCode::KernelTooRough, too_rough),
            (flagged(DegeneracyReason::UnderResolved), WarningCode::DisagreesWithNeighbours, DISAGREES),
            (flagged(DegeneracyReason::FarFromCloud), WarningCode::FarFromCloud, FAR),
        ];
        let counted = counted.into_iter().filter(|(count, ..)| *count > 0);
        let mut warnings: Vec<Warning> = counted
            .map(|(count, code, what)| Warning { code, detail: format!("{what} (queries: {count} of {m})") })
            .collect();
        if self.orientation == Orientation::Gradient {
            return warnings;
        }
        if orientation.n_flipped > 0 {
            let detail = format!("the gradient pointed inward at {} of {n} points", orientation.n_flipped);
            warnings.push(Warning { code: WarningCode::OrientationRepaired, detail });
        }
        if orientation.is_open && !orientation.is_given {
            warnings.push(Warning { code: WarningCode::OpenCloud, detail: OPEN_CLOUD.to_owned() });
        }
        warnings
    }
}

const LAPLACE_TOO_ROUGH: &str = "curvatures see the cusp of the kernel at the points; raise epsilon until sqrt(epsilon)·length_scale is twice the spacing";
const KERNEL_TOO_ROUGH: &str = "curvatures see the cusp of the kernel at the points; take a smoother kernel";
const DISAGREES: &str = "curvatures are not confirmed by the points around them; see degenerate";
const FAR: &str = "farther from the cloud than three spacings";
const OPEN_CLOUD: &str =
    "the cloud has a rim, so that outward has no meaning; the side is that of most gradients";
