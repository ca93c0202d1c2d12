//! A plan with its factorization: weights, signature functions and diagnostics.

use std::borrow::Cow;
use std::sync::Arc;

use super::array::Array;
use super::compute::JobObserver;
use super::fit::FitPlan;
use super::problem::Problem;
use super::shared::{
    Degenerate, DegenerateReason, Diagnostics, FactorizationUsed, OrientationChoice, SolverUsed, Warning,
    WarningCode,
};
use crate::app::App;
use crate::numerics::cloud::Cloud;
use crate::numerics::error::NumericsError;
use crate::numerics::geometry::{Degeneracy, DegeneracyReason, Geometry, Orientation};
use crate::numerics::interpolant::Interpolant;
use crate::numerics::regularization::Regularization;
use crate::numerics::solver::{Method, Solution};
use crate::store::factors::StoredFactor;
use crate::store::key::ValuesKey;

/// Below this reciprocal condition fewer than three digits of the weights are sure.
const ILL_CONDITIONED: f64 = 1e-13;

/// The fits of one request.
pub struct Fits {
    pub app: Arc<App>,
    pub main: Fitted,
    /// Present if it differs from the main one.
    pub surface: Option<Fitted>,
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

    /// The signature function of the surface.
    ///
    /// # Errors
    /// Those of [`Solution::of`] as a [`Problem`].
    pub fn signature(&self, observer: &JobObserver) -> Result<Interpolant, Problem> {
        let surface = self.surface();
        surface.interpolant(&self.app, &vec![1.0; surface.plan.stored.cloud.n_points()], observer)
    }

    /// The geometry of the surface at queries, with its signature function.
    ///
    /// # Errors
    /// Those of [`Geometry::of`] as a [`Problem`].
    pub fn geometry(
        &self,
        queries: &Cloud,
        orientation: OrientationChoice,
        observer: &JobObserver,
    ) -> Result<(Geometry, Interpolant), Problem> {
        let surface = self.surface();
        let signature = self.signature(observer)?;
        let orientation = match orientation {
            OrientationChoice::Outward => Orientation::Outward,
            OrientationChoice::Gradient => Orientation::Gradient,
        };
        let geometry = Geometry::of(&signature, surface.stored.neighbours(), queries, orientation, observer)
            .map_err(|error| surface.refused(error))?;
        Ok((geometry, signature))
    }
}

/// A fit with its factorization.
pub struct Fitted {
    pub plan: FitPlan,
    pub stored: Arc<StoredFactor>,
}

impl Fitted {
    /// A refusal of the numerics, with pointers into this fit.
    pub fn refused(&self, error: NumericsError) -> Problem {
        self.plan.refused(error)
    }

    /// Finds the weights of values that were solved before, or solves.
    fn interpolant(&self, app: &App, values: &[f64], observer: &JobObserver) -> Result<Interpolant, Problem> {
        let factor = self.stored.factor.clone();
        let key = ValuesKey::of(values);
        if let Some(solution) = app.factors.solution(self.plan.key, key) {
            return Ok(Interpolant { factor, solution });
        }
        let interpolant =
            Interpolant::fit(factor, &self.merged(values), observer).map_err(|error| self.refused(error))?;
        app.factors.keep_solution(self.plan.key, key, interpolant.solution.clone());
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
        let (plan, factor) = (&self.plan, &self.stored.factor);
        let n_merged = plan.merge.as_ref().map_or(0, |merge| merge.n_merged());
        let mut warnings = Vec::new();
        let mut warn = |code, detail| warnings.push(Warning { code, detail });
        let reciprocal_condition = factor.reciprocal_condition();
        if factor.method() == Method::PivotedCholesky {
            let (rank, n) = (factor.rank(), factor.n_points());
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
            factorization: match factor.method() {
                Method::Cholesky => FactorizationUsed::Cholesky,
                Method::PivotedCholesky => FactorizationUsed::PivotedCholesky,
            },
            rank: factor.rank(),
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

/// The degenerate queries of an answer.
pub fn degenerate(geometry: &Geometry) -> Vec<Degenerate> {
    let entry = |d: &Degeneracy| Degenerate {
        query: d.query,
        reason: match d.reason {
            DegeneracyReason::VanishingGradient => DegenerateReason::VanishingGradient,
        },
        gradient_norm: d.gradient_norm,
    };
    geometry.degenerate().iter().map(entry).collect()
}

/// Numbers per query, null at the degenerate ones.
pub fn per_query(geometry: &Geometry, data: Vec<f64>, shape: &[usize]) -> Array {
    Array::new(data, shape).with_nulls(0, geometry.is_degenerate())
}
