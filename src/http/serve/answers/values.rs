//! Values at queries, with the diagnostics of their answer.

use crate::http::fields::Diagnostics;
use crate::http::problem::Problem;
use crate::http::serve::fitted::Fits;
use crate::http::serve::plan::Values;
use gramian_host::compute::JobObserver;
use gramian_host::wire::write::array::Array;
use gramian_numerics::model::{EachAt, JetRequest, ValuesAt};
use gramian_numerics::regression::function::batch::Batch;
use gramian_numerics::regression::solver::trend::Trend;

impl Fits {
    /// Computes the function with these values at queries.
    ///
    /// # Errors
    /// Returns the refusals of the numerics as a [`Problem`].
    pub fn values_at(
        &self,
        values: &Values,
        request: JetRequest<'_>,
        observer: &JobObserver,
    ) -> Result<(ValuesAt, Diagnostics), Problem> {
        let fitted = &self.main;
        let solve = |known| {
            let merged = fitted.plan.merged(&values.list);
            fitted.model().values_at(fitted.fitted_values(&merged), request, known, observer)
        };
        let found = self.with_known_weights(values.key, solve, |found| {
            found.interpolant.as_ref().map(|function| &function.solution)
        })?;
        let mut diagnostics = fitted.diagnostics(&found.report, request.queries.n_points());
        diagnostics.warn_of_unsettled(found.report.unsettled);
        fitted.warn_of_poor_fit(&mut diagnostics, found.report.disagreement, has_deviations(request));
        Ok((found, diagnostics))
    }

    /// Computes the functions with these lists of values at queries.
    ///
    /// # Errors
    /// Returns the refusals of the numerics as a [`Problem`].
    pub fn each_at(
        &self,
        values: &Values,
        request: JetRequest<'_>,
        observer: &JobObserver,
    ) -> Result<(EachAt, Diagnostics), Problem> {
        let fitted = &self.main;
        let merged = fitted.plan.merged(&values.list);
        let found = fitted.model().each_at(fitted.fitted_values(&merged), request, observer);
        let found = found.map_err(|error| fitted.refused(error))?;
        let mut diagnostics = fitted.diagnostics(&found.report, request.queries.n_points());
        if let Some(disagreement) = found.report.disagreement {
            fitted.warn_of_poor_fit(&mut diagnostics, Some(disagreement), has_deviations(request));
        }
        Ok((found, diagnostics))
    }
}

/// Coefficients of the mean of each function, `[k, p]`, or `None` where the functions have no mean.
pub fn mean_coefficients(batch: &Batch) -> Option<Array> {
    let trends = batch.solutions.iter().map(|solution| solution.trend.as_ref().map(Trend::of_coordinates));
    let rows: Vec<Vec<f64>> = trends.collect::<Option<_>>()?;
    let width = rows.first()?.len();
    Some(Array::new(rows.concat(), &[rows.len(), width]))
}

fn has_deviations(request: JetRequest<'_>) -> bool {
    request.has_variances || request.deviations.is_some()
}
