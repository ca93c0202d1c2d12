//! Fits of a request with their models.

use std::sync::Arc;

use super::plan::{FitPlan, Values};
use crate::http::problem::Problem;
use crate::http::state::app::App;
use crate::store::key::ValuesKey;
use crate::store::prepared::PreparedFit;
use gramian_host::compute::JobObserver;
use gramian_numerics::error::NumericsError;
use gramian_numerics::model::{FittedValues, Model};
use gramian_numerics::observer::WithoutStages;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::regression::selection::{LearnedModel, Noise, ObservedCloud, learn, learn_alike};
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::regression::solver::{EarlierSolutions, Solution};
use gramian_numerics::surface::Surface;

/// The fits of one request.
pub struct Fits {
    pub app: Arc<App>,
    /// Fit of the values, or of the surface where there are no values.
    pub main: FitModel,
    /// Fit of the surface, where it differs from the main fit.
    pub surface: Option<FitModel>,
    /// The surface, for operations that need one.
    pub made: Option<Arc<Surface>>,
}

/// A fit with its model.
pub struct FitModel {
    pub plan: FitPlan,
    pub stored: Arc<PreparedFit>,
}

impl Fits {
    /// Returns the fit of the surface.
    pub fn surface(&self) -> &FitModel {
        self.surface.as_ref().unwrap_or(&self.main)
    }

    /// Returns the surface of an operation that needs one.
    ///
    /// # Errors
    /// 500 `internal` for an operation that said it needs none. That is a bug.
    pub fn made_surface(&self) -> Result<&Arc<Surface>, Problem> {
        self.made.as_ref().ok_or_else(Problem::internal)
    }

    /// Returns the function with these values.
    ///
    /// # Errors
    /// Returns the errors of [`Solution::of`] as a [`Problem`].
    pub fn interpolant(&self, values: &Values, observer: &JobObserver) -> Result<Interpolant, Problem> {
        self.function(&values.list, values.key, self.main.plan.process.mean, observer)
    }

    /// Returns the function through the constant 1, without a mean. It shows the quality of a fit without
    /// values.
    ///
    /// # Errors
    /// Returns the errors of [`Solution::of`] as a [`Problem`].
    pub fn interpolant_of_one(&self, observer: &JobObserver) -> Result<Interpolant, Problem> {
        let ones = vec![1.0; self.main.plan.stored.cloud.n_points()];
        self.function(&ones, ValuesKey::of(&ones), Mean::Zero, observer)
    }

    fn function(
        &self,
        values: &[f64],
        key: ValuesKey,
        mean: Mean,
        observer: &JobObserver,
    ) -> Result<Interpolant, Problem> {
        let merged = self.main.plan.merged(values);
        let solve = |known| self.main.model().interpolant(&merged, mean, known, observer);
        self.with_known_weights(key, solve, |function| Some(&function.solution))
    }

    /// Solves with cached weights of these values, or from those of others, if there are any. New weights are
    /// cached.
    pub(super) fn with_known_weights<T>(
        &self,
        values: ValuesKey,
        solve: impl FnOnce(EarlierSolutions) -> Result<T, NumericsError>,
        solution: impl FnOnce(&T) -> Option<&Arc<Solution>>,
    ) -> Result<T, Problem> {
        let key = self.main.plan.key;
        let known = self.app.prepared.known(key, values);
        let is_new = known.these.is_none();
        let found = solve(known).map_err(|error| self.main.refused(error))?;
        if let Some(solution) = solution(&found).filter(|_| is_new) {
            self.app.prepared.keep_solution(key, values, solution.clone());
        }
        Ok(found)
    }

    /// Learns kernel and noise from the values where the kernel is given. Returns `None` if they were learned
    /// already.
    ///
    /// # Errors
    /// Returns the errors of [`learn`].
    pub fn learned_beside(
        &self,
        values: &[f64],
        observer: &JobObserver,
    ) -> Result<Option<LearnedModel>, NumericsError> {
        let FitPlan { stored, fitted, merge, recipe, process, .. } = &self.main.plan;
        if process.is_learned {
            return Ok(None);
        }
        let observer = WithoutStages(observer);
        // Learning uses the coordinates of a kernel that stretches them, so the ratios between axes are not
        // judged.
        let stretched = recipe.process().and_then(|(kernel, _)| kernel.stretched_cloud(fitted));
        let cloud = stretched.as_ref().unwrap_or(fitted);
        let sampling = match stored.sampling().filter(|_| merge.is_none() && stretched.is_none()) {
            Some(sampling) => sampling.clone(),
            None => Arc::new(Sampling::of(cloud, &observer)?),
        };
        let values = &self.main.plan.merged(values);
        let (noise, mean) = (Noise::Unknown, Mean::Constant);
        let observed = ObservedCloud { cloud, sampling: &sampling, values, noise, mean };
        let learn = if stretched.is_some() { learn_alike } else { learn };
        learn(observed, &observer).map(Some)
    }
}

impl FitModel {
    pub fn model(&self) -> &Model {
        self.stored.model()
    }

    /// Returns a refusal of the numerics, with pointers into this fit.
    pub fn refused(&self, error: NumericsError) -> Problem {
        self.plan.refused(error)
    }

    /// Returns values at the fitted points, with their assumed process.
    pub fn fitted_values<'a>(&'a self, merged: &'a [f64]) -> FittedValues<'a> {
        let process = &self.plan.process;
        FittedValues { values: merged, mean: process.mean, trend: self.plan.trend(), scale: process.scale }
    }

    /// Returns a matrix of this fit with one column per point of the client's cloud.
    pub fn unmerge(&self, matrix: Vec<f64>) -> Vec<f64> {
        match &self.plan.merge {
            None => matrix,
            Some(merge) => merge.spread(&matrix),
        }
    }
}
