//! A plan with its factorization: weights, signature functions and diagnostics.

use std::borrow::Cow;
use std::sync::Arc;

use super::plan::{FitModel, FitPlan, LocalReason};
use crate::http::compute::JobObserver;
use crate::http::fields::{
    Degenerate, DegenerateReason, Diagnostics, FactorizationUsed, KernelUsed, SolverUsed, StencilsUsed,
    SurfaceUsed, Warning, WarningCode,
};
use crate::http::problem::Problem;
use crate::http::state::app::App;
use crate::http::wire::write::array::Array;
use crate::store::key::ValuesKey;
use crate::store::prepared::PreparedFit;
use gramian_numerics::error::NumericsError;
use gramian_numerics::function::interpolant::Interpolant;
use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::observer::Beside;
use gramian_numerics::patches::PatchKernel;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::selection::{Learned, Noise, Observed, learn};
use gramian_numerics::solver::choose::AutoLocal;
use gramian_numerics::solver::trend::{Mean, Trend};
use gramian_numerics::solver::{Disagreement, Method, Outlier, Solution, Solver};
use gramian_numerics::sums::regularization::Regularization;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::degeneracy::{Degeneracy, DegeneracyReason};
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest, Orientation};
use gramian_numerics::surface::local::LocalSurface;
use gramian_numerics::surface::served::ServedBy;
use gramian_numerics::surface::signature::SignatureSurface;

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
        self.main.interpolant(&self.app, values, self.main.plan.mean, observer)
    }

    /// What is learned from the values, where the kernel is given and they were not asked.
    ///
    /// # Errors
    /// Those of [`learn`].
    pub fn learned_beside(
        &self,
        values: &[f64],
        observer: &JobObserver,
    ) -> Result<Option<Learned>, NumericsError> {
        let FitPlan { stored, fitted, merge, is_learned, .. } = &self.main.plan;
        if *is_learned {
            return Ok(None);
        }
        let observer = Beside(observer);
        // In the coordinates of a kernel that stretches them: what it says of the axes is not judged.
        let stretched = self.main.kernel().and_then(|kernel| kernel.stretched_cloud(fitted));
        let cloud = stretched.as_ref().unwrap_or(fitted);
        let sampling = match stored.sampling().filter(|_| merge.is_none() && stretched.is_none()) {
            Some(sampling) => sampling.clone(),
            None => Arc::new(Sampling::of(cloud, &observer)?),
        };
        let values = &self.main.merged(values);
        let (noise, mean) = (Noise::Unknown, Mean::Constant);
        learn(Observed { cloud, sampling: &sampling, values, noise, mean }, &observer).map(Some)
    }

    /// The function through the constant 1, without a mean: what the quality of a fit without values is judged by.
    ///
    /// # Errors
    /// Those of [`Solution::of`] as a [`Problem`].
    pub fn interpolant_of_one(&self, observer: &JobObserver) -> Result<Interpolant, Problem> {
        let ones = vec![1.0; self.main.plan.stored.cloud.n_points()];
        self.main.interpolant(&self.app, &ones, Mean::Zero, observer)
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
        Ok(SurfaceGeometry { surface, geometry, stencils: None, request: *request })
    }
}

/// A surface with its geometry at the queries of a request.
pub struct SurfaceGeometry {
    pub surface: Arc<Surface>,
    pub geometry: Geometry,
    /// Rows of the sparse operator over it, once there is one.
    pub stencils: Option<StencilsUsed>,
    request: GeometryRequest,
}

/// Standard deviations, one entry per query.
pub struct DeviationArrays {
    pub normal: Array,
    pub principal: Array,
    pub mean: Array,
    pub gaussian: Array,
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

    /// The solver of values.
    ///
    /// # Errors
    /// None: fits of values are planned with one.
    pub fn solver(&self) -> Result<&Arc<Solver>, Problem> {
        self.stored.solver().ok_or_else(Problem::internal)
    }

    /// Finds the weights of values that were solved before, or solves.
    fn interpolant(
        &self,
        app: &App,
        values: &[f64],
        mean: Mean,
        observer: &JobObserver,
    ) -> Result<Interpolant, Problem> {
        let solver = self.solver()?.clone();
        let key = ValuesKey::with_mean(values, mean);
        if let Some(solution) = app.prepared.solution(self.plan.key, key) {
            return Ok(Interpolant { solver, solution });
        }
        let interpolant = Interpolant::fit_with_mean(solver, &self.merged(values), mean, observer)
            .map_err(|error| self.refused(error))?;
        app.prepared.keep_solution(self.plan.key, key, interpolant.solution.clone());
        Ok(interpolant)
    }

    /// That of a fit with one.
    fn kernel(&self) -> Option<&Kernel> {
        match &self.plan.model {
            FitModel::Dense { kernel, .. } | FitModel::Moving { kernel, .. } => Some(kernel),
            FitModel::Local { .. } => None,
        }
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

    /// What the answer says of this fit and of a function that was solved with it.
    ///
    /// # Errors
    /// Those of [`Fitted::solver`].
    pub fn diagnostics(&self, solution: &Solution, n_queries: usize) -> Result<Diagnostics, Problem> {
        let (plan, solver) = (&self.plan, self.solver()?);
        let FitModel::Dense { kernel, regularization } = &plan.model else { return Err(Problem::internal()) };
        let (reciprocal_condition, scale) = (solver.reciprocal_condition(), plan.scale);
        Ok(Diagnostics {
            kernel: KernelUsed::scaled(kernel, scale),
            alpha: uniform(regularization).map(|alpha| alpha * scale),
            mean_coefficients: solution.trend.as_ref().map(Trend::of_coordinates),
            factorization: match solver.method() {
                Method::Cholesky => FactorizationUsed::Cholesky,
                Method::PivotedCholesky => FactorizationUsed::PivotedCholesky,
            },
            rank: Some(solver.rank()),
            reciprocal_condition: Some(reciprocal_condition),
            relative_residual: Some(solution.relative_residual),
            native_norm_squared: Some(solution.native_norm_squared / scale),
            misfit: Some(solution.misfit),
            warnings: self.warnings(solver, solution),
            ..self.blank(SolverUsed::Dense, n_queries)
        })
    }

    /// What is said of any fit.
    fn blank(&self, solver: SolverUsed, n_queries: usize) -> Diagnostics {
        let cloud = &self.plan.stored.cloud;
        Diagnostics {
            cloud_id: self.plan.stored.id.to_string(),
            n_points: cloud.n_points(),
            n_queries,
            dimension: cloud.dimension(),
            kernel: KernelUsed::heights(PatchKernel::default()),
            alpha: None,
            solver,
            solver_reason: None,
            factorization: FactorizationUsed::Local,
            rank: None,
            reciprocal_condition: None,
            relative_residual: None,
            native_norm_squared: None,
            mean_coefficients: None,
            misfit: None,
            noise_deviation: None,
            n_merged_duplicates: self.plan.merge.as_ref().map_or(0, |merge| merge.n_merged()),
            stencils: None,
            warnings: Vec::new(),
            geometry: None,
        }
    }

    fn warnings(&self, solver: &Solver, solution: &Solution) -> Vec<Warning> {
        let mut warnings = Vec::new();
        let mut warn = |code, detail| warnings.push(Warning { code, detail });
        let reciprocal_condition = solver.reciprocal_condition();
        if solver.method() == Method::PivotedCholesky {
            let (rank, n) = (solver.rank(), solver.n_points());
            let detail = format!(
                "Cholesky fails in float64; least squares on {rank} of {n} points, which span the rest to rounding"
            );
            warn(WarningCode::IllConditioned, detail);
        } else if reciprocal_condition < ILL_CONDITIONED && !self.plan.is_learned {
            // Where the values decided, the least noise is what float64 bears, and the weights follow it on purpose.
            let detail = format!("the reciprocal condition is {reciprocal_condition:.1e}");
            warn(WarningCode::IllConditioned, detail);
        }
        if solution.refined {
            let detail = format!("refined to a relative residual of {:.1e}", solution.relative_residual);
            warn(WarningCode::Refined, detail);
        }
        warnings.extend(self.warnings_beforehand());
        warnings
    }

    /// Warns where values contradict kernel and noise: those of a function that was solved, or else those that were
    /// learned from. Where kernel and noise are given, only answers with deviations have the warning: the values
    /// alone depend on nothing but the ratio of the two.
    pub fn warn_of_misfit(
        &self,
        diagnostics: &mut Diagnostics,
        solution: Option<&Solution>,
        has_deviations: bool,
    ) {
        let plan = &self.plan;
        // Learning sees the points as they were sent, a solver sees them merged.
        let as_sent = |point: usize| plan.merge.as_ref().map_or(point, |merge| merge.first_point(point));
        let of_solution = solution.and_then(|solution| {
            let found = solution.disagreement(plan.fitted.n_points(), plan.scale)?;
            let outlier = found.outlier.map(|found| Outlier { point: as_sent(found.point), ..found });
            Some(Disagreement { outlier, ..found })
        });
        let found = of_solution.or_else(|| plan.disagreement());
        let Some(found) = found.filter(|_| plan.is_learned || has_deviations) else { return };
        let remedy = if plan.is_learned { MISFIT_OF_LEARNED } else { MISFIT_OF_GIVEN };
        diagnostics.warn_of_misfit(found, remedy);
    }

    /// Warnings that are known before anything is solved.
    fn warnings_beforehand(&self) -> Vec<Warning> {
        let mut warnings = Vec::new();
        if let Some(merge) = &self.plan.merge {
            let detail = format!("points merged into an earlier one: {}", merge.n_merged());
            warnings.push(Warning { code: WarningCode::DuplicatesMerged, detail });
        }
        if self.plan.has_least_variance() {
            let detail = TOO_SMALL.to_owned();
            warnings.push(Warning { code: WarningCode::VarianceClamped, detail });
        }
        warnings
    }

    /// What the answer says of values from the points nearest to each query.
    ///
    /// # Errors
    /// None: the fits that have such values have a kernel.
    pub fn moving_diagnostics(
        &self,
        (m, n_dependent): (usize, usize),
        n_neighbours: usize,
    ) -> Result<Diagnostics, Problem> {
        let FitModel::Moving { kernel, regularization, reason } = &self.plan.model else {
            return Err(Problem::internal());
        };
        let mut warnings = self.warnings_beforehand();
        if n_dependent > 0 {
            let detail = format!(
                "points that follow from nearer ones to rounding are left out of the {n_neighbours} nearest (queries: {n_dependent} of {m})"
            );
            warnings.push(Warning { code: WarningCode::IllConditioned, detail });
        }
        let (scale, trend) = (self.plan.scale, self.plan.trend());
        Ok(Diagnostics {
            kernel: KernelUsed::scaled(kernel, scale),
            alpha: uniform(regularization).map(|alpha| alpha * scale),
            mean_coefficients: trend.map(Trend::of_coordinates),
            solver_reason: reason.words().map(str::to_owned),
            warnings,
            ..self.blank(SolverUsed::Local, m)
        })
    }

    /// What the answer says of local regressions.
    fn local_diagnostics(&self, surface: &LocalSurface, n_queries: usize) -> Diagnostics {
        let reason = match self.plan.model {
            FitModel::Local { reason, .. } => reason.words(),
            FitModel::Dense { .. } | FitModel::Moving { .. } => None,
        };
        let noise = surface.patches().noise();
        Diagnostics {
            kernel: KernelUsed::heights(surface.patches().kernel()),
            alpha: Some(noise * noise),
            solver_reason: reason.map(str::to_owned),
            misfit: Some(surface.misfit()),
            noise_deviation: Some(noise),
            ..self.blank(SolverUsed::Local, n_queries)
        }
    }
}

impl LocalReason {
    /// As the diagnostics say it; nothing where it was asked for.
    fn words(self) -> Option<&'static str> {
        match self {
            Self::Asked => None,
            Self::Auto(AutoLocal::BeyondDense) => Some(BEYOND_DENSE),
            Self::Auto(AutoLocal::ManyPoints) => Some(MANY_POINTS),
            Self::Auto(AutoLocal::Deviations) => Some(DEVIATIONS),
        }
    }
}

fn uniform(regularization: &Regularization) -> Option<f64> {
    match regularization {
        Regularization::Uniform(alpha) => Some(*alpha),
        Regularization::PerPoint(_) => None,
    }
}

const TOO_SMALL: &str = "squares of the values leave float64: their variance is taken to be 1e-290, and deviations are too long; scale the values";
const MISFIT_OF_LEARNED: &str =
    "deviations there may be too short: look at these values, or give a kernel that is shorter or rougher";
const MISFIT_OF_GIVEN: &str = "deviations are too short: leave out kernel and alpha, so that they are learned, or raise variance and alpha";
const BEYOND_DENSE: &str = "the cloud has more points than are factorized densely";
const MANY_POINTS: &str =
    "regressions from the nearest points take time linear in the points, of which there are many";
const DEVIATIONS: &str = "standard deviations come from local regressions";

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
                DegeneracyReason::AmbiguousSide => DegenerateReason::AmbiguousSide,
            },
            gradient_norm: d.gradient_norm,
        };
        self.geometry.degenerate().iter().map(entry).collect()
    }

    /// Flags queries, unless they are flagged already, where what was found of values is doubtful: all of them where nobody can tell.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub fn flag_uncertain(
        &self,
        judged: Result<Vec<usize>, NumericsError>,
        degenerate: &mut Vec<Degenerate>,
    ) -> Result<(), NumericsError> {
        let m = self.geometry.n_queries();
        let queries = match judged {
            Err(NumericsError::Cancelled) => return Err(NumericsError::Cancelled),
            Err(_) => (0..m).collect(),
            Ok(queries) => queries,
        };
        let mut is_flagged = self.geometry.is_null().to_vec();
        degenerate.iter().for_each(|entry| is_flagged[entry.query] = true);
        for query in queries {
            if !std::mem::replace(&mut is_flagged[query], true) {
                let gradient_norm = self.geometry.gradient_norms()[query];
                degenerate.push(Degenerate { query, reason: DegenerateReason::Uncertain, gradient_norm });
            }
        }
        degenerate.sort_by_key(|entry| entry.query);
        Ok(())
    }

    /// Deviations per query, null where there is no answer, and where those of the surface are not known.
    pub fn known_per_query(&self, data: Vec<f64>, shape: &[usize]) -> Array {
        let is_null: Vec<bool> = match self.geometry.deviations() {
            None => self.geometry.is_null().to_vec(),
            Some(known) => {
                let both = known.is_known.iter().zip(self.geometry.is_null());
                both.map(|(is_known, is_null)| !is_known || *is_null).collect()
            }
        };
        Array::new(data, shape).with_nulls(0, &is_null)
    }

    /// Numbers per query, null where there is no answer.
    pub fn per_query(&self, data: Vec<f64>, shape: &[usize]) -> Array {
        Array::new(data, shape).with_nulls(0, self.geometry.is_null())
    }

    /// The function that serves each query.
    pub fn surfaces(&self) -> Vec<SurfaceUsed> {
        let used = |query| match self.geometry.served_by(query) {
            ServedBy::Signature => SurfaceUsed::Signature,
            ServedBy::Offset => SurfaceUsed::Offset,
            ServedBy::Local => SurfaceUsed::Local,
        };
        (0..self.geometry.n_queries()).map(used).collect()
    }

    /// What the answer says of the fit of this surface.
    ///
    /// # Errors
    /// Those of [`Fitted::diagnostics`].
    pub fn diagnostics(&self, fits: &Fits) -> Result<Diagnostics, Problem> {
        let (fitted, m) = (fits.surface(), self.geometry.n_queries());
        let mut diagnostics = match &*self.surface {
            Surface::Signature(surface) => fitted.diagnostics(&surface.signature().solution, m)?,
            Surface::Local(surface) => fitted.local_diagnostics(surface, m),
        };
        diagnostics.warnings.extend(self.warnings());
        diagnostics.stencils = self.stencils;
        Ok(diagnostics)
    }

    /// Deviations per query, null where there is no answer or no deviation of it.
    pub fn deviations(&self) -> Option<DeviationArrays> {
        let deviations = self.geometry.deviations()?;
        let (m, k) = (self.geometry.n_queries(), self.geometry.dimension() - 1);
        let is_null: Vec<bool> = deviations
            .is_known
            .iter()
            .zip(self.geometry.is_null())
            .map(|(is_known, is_null)| !is_known || *is_null)
            .collect();
        let array = |data: &[f64], shape: &[usize]| Array::new(data.to_vec(), shape).with_nulls(0, &is_null);
        Some(DeviationArrays {
            normal: array(&deviations.normal, &[m]),
            principal: array(&deviations.principal, &[m, k]),
            mean: array(&deviations.mean, &[m]),
            gaussian: array(&deviations.gaussian, &[m]),
        })
    }

    /// What was changed, and what the flags of single queries amount to.
    fn warnings(&self) -> Vec<Warning> {
        let (m, n) = (self.geometry.n_queries(), self.surface.cloud().n_points());
        let flagged =
            |reason| self.geometry.degenerate().iter().filter(|entry| entry.reason == reason).count();
        let n_offset = (0..m).filter(|&query| self.geometry.served_by(query) == ServedBy::Offset).count();
        let orientation = self.surface.orientation();
        let too_rough = match &*self.surface {
            Surface::Signature(surface) if is_laplace(surface) => LAPLACE_TOO_ROUGH,
            Surface::Signature(_) | Surface::Local(_) => KERNEL_TOO_ROUGH,
        };
        let disagrees = if self.request.checks_curvatures { DISAGREES } else { UNCERTAIN };
        let counted = [
            (n_offset, WarningCode::OffsetModelUsed, "served by the offset model"),
            (flagged(DegeneracyReason::KernelTooRough), WarningCode::KernelTooRough, too_rough),
            (flagged(DegeneracyReason::UnderResolved), WarningCode::DisagreesWithNeighbours, disagrees),
            (flagged(DegeneracyReason::FarFromCloud), WarningCode::FarFromCloud, FAR),
        ];
        let counted = counted.into_iter().filter(|(count, ..)| *count > 0);
        let mut warnings: Vec<Warning> = counted
            .map(|(count, code, what)| Warning { code, detail: format!("{what} (queries: {count} of {m})") })
            .collect();
        if self.request.orientation == Orientation::Gradient {
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

fn is_laplace(surface: &SignatureSurface) -> bool {
    matches!(surface.signature().solver.kernel().family(), Family::Laplace { .. })
}

const LAPLACE_TOO_ROUGH: &str = "curvatures see the cusp of the kernel at the points; raise epsilon until sqrt(epsilon)·length_scale is twice the spacing";
const KERNEL_TOO_ROUGH: &str = "curvatures see the cusp of the kernel at the points; take a smoother kernel";
const DISAGREES: &str = "curvatures are not confirmed by the points around them; see degenerate";
const UNCERTAIN: &str = "normals are uncertain by 17 degrees and more; see degenerate";
const FAR: &str = "farther from the cloud than three spacings";
const OPEN_CLOUD: &str =
    "the cloud has a rim, so that outward has no meaning; the side is that of most gradients";
