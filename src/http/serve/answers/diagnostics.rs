//! Diagnostics of an answer, from the plan of its fit and the report of its model.

use crate::http::fields::{
    Diagnostics, FactorizationUsed, Hyperparameters, KernelUsed, Warning, WarningCode,
};
use crate::http::serve::fitted::FitModel;
use crate::http::serve::plan::words;
use gramian_numerics::model::Report;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::solver::trend::Trend;
use gramian_numerics::regression::solver::{Disagreement, Method, Outlier};
use gramian_numerics::regression::sums::regularization::Regularization;

/// Reciprocal condition below which fewer than three digits of the weights are certain.
const ILL_CONDITIONED: f64 = 1e-13;

const TOO_SMALL: &str = "squares of the values underflow float64: their variance is set to 1e-290, and deviations are too large; scale the values";
const POOR_FIT_OF_LEARNED: &str = "deviations there may be too small: check these values, or use a kernel with a shorter length scale or less smoothness";
const POOR_FIT_OF_GIVEN: &str = "deviations are too small: leave out kernel and alpha so that they are learned, or raise variance and alpha";

impl FitModel {
    /// Returns the diagnostics of this fit and of the function or surface served from it.
    pub fn diagnostics(&self, report: &Report, n_queries: usize) -> Diagnostics {
        let plan = &self.plan;
        let (cloud, scale) = (&plan.stored.cloud, plan.process.scale);
        let (kernel, alpha) = self.process_used(report);
        Diagnostics {
            cloud_id: plan.stored.id.to_string(),
            n_points: cloud.n_points(),
            n_queries,
            dimension: cloud.dimension(),
            kernel,
            alpha,
            solver: plan.recipe.solver().into(),
            solver_reason: plan.reason.map(|reason| words(reason).to_owned()),
            factorization: match report.method {
                Some(Method::Cholesky) => FactorizationUsed::Cholesky,
                Some(Method::PivotedCholesky) => FactorizationUsed::PivotedCholesky,
                Some(Method::Landmark) => FactorizationUsed::Landmark,
                Some(Method::ConjugateGradients) => FactorizationUsed::ConjugateGradients,
                None => FactorizationUsed::Local,
            },
            rank: report.rank,
            remaining_diagonal: report.remaining.map(|remaining| remaining.largest * scale),
            diagonal_tolerance: report.remaining.map(|remaining| remaining.tolerance * scale),
            tolerance: report.tolerance,
            iterations: report.n_iterations,
            reciprocal_condition: report.reciprocal_condition,
            relative_residual: report.relative_residual,
            native_norm_squared: report.native_norm_squared.map(|norm| norm / scale),
            mean_coefficients: report.trend.as_ref().map(Trend::of_coordinates),
            misfit: report.misfit,
            noise_deviation: report.hyperparameters.as_ref().map(|learned| learned.regression.noise),
            n_merged_duplicates: plan.merge.as_ref().map_or(0, |merge| merge.n_merged()),
            hyperparameters: report.hyperparameters.as_ref().map(Hyperparameters::of),
            reach: report.reach,
            stencils: None,
            warnings: self.warnings(report, n_queries),
            surface: None,
        }
    }

    /// Returns kernel and α of the request, or those learned from the values. Local regressions have those of
    /// heights.
    fn process_used(&self, report: &Report) -> (KernelUsed, Option<f64>) {
        match self.plan.recipe.process() {
            Some((kernel, regularization)) => {
                let scale = self.plan.process.scale;
                let alpha = match regularization {
                    Regularization::Uniform(alpha) => Some(alpha * scale),
                    Regularization::PerPoint(_) => None,
                };
                (KernelUsed::scaled(kernel, scale), alpha)
            }
            None => {
                let learned = report.hyperparameters.as_ref().map(|learned| &learned.regression);
                let heights = learned.map(|learned| learned.kernel);
                (KernelUsed::heights(heights.unwrap_or_default()), learned.map(|of| of.noise * of.noise))
            }
        }
    }

    fn warnings(&self, report: &Report, n_queries: usize) -> Vec<Warning> {
        let plan = &self.plan;
        let mut warnings = Vec::new();
        let mut warn = |code, detail| warnings.push(Warning { code, detail });
        let is_pivoted = report.method == Some(Method::PivotedCholesky);
        let reciprocal_condition = report.reciprocal_condition.unwrap_or(1.0);
        if is_pivoted {
            let (rank, n) = (report.rank.unwrap_or_default(), plan.fitted.n_points());
            let detail = format!(
                "Cholesky fails in float64; solved by least squares on {rank} of {n} points, which span the others to rounding"
            );
            warn(WarningCode::IllConditioned, detail);
        } else if reciprocal_condition < ILL_CONDITIONED && !plan.process.is_learned {
            // Where the values decided, float64 sets the least noise. The weights follow it on purpose.
            let detail = format!("the reciprocal condition is {reciprocal_condition:.1e}");
            warn(WarningCode::IllConditioned, detail);
        }
        if report.is_refined {
            let residual = report.relative_residual.unwrap_or_default();
            warn(WarningCode::Refined, format!("refined to a relative residual of {residual:.1e}"));
        }
        match (&plan.merge, plan.process.n_copies()) {
            (None, _) => {}
            (Some(merge), 0) => {
                let detail = format!("points merged into an earlier one: {}", merge.n_merged());
                warn(WarningCode::DuplicatesMerged, detail);
            }
            (Some(_), n_copies) => {
                let Warning { code, detail } = repeated_rows(n_copies);
                warn(code, detail);
            }
        }
        let has_own_scales = plan.recipe.process().is_some_and(|(kernel, _)| kernel.is_stretched());
        if plan.process.is_learned && !has_own_scales {
            units_differ(&plan.fitted).into_iter().for_each(|detail| warn(WarningCode::UnitsDiffer, detail));
        }
        if plan.has_least_variance() {
            warn(WarningCode::VarianceClamped, TOO_SMALL.to_owned());
        }
        if report.n_dependent > 0 {
            let detail = format!(
                "some of the {} nearest points depend on nearer ones to rounding and are left out (queries: {} of {n_queries})",
                report.n_neighbours, report.n_dependent
            );
            warn(WarningCode::IllConditioned, detail);
        }
        warnings
    }

    /// Warns where values contradict kernel and noise.
    ///
    /// The contradiction is that of the solved function, or else the one found when learning. Where kernel
    /// and noise are given, only answers with deviations get the warning. Without deviations, an answer
    /// depends only on the ratio of the two.
    pub fn warn_of_poor_fit(
        &self,
        diagnostics: &mut Diagnostics,
        of_solution: Option<Disagreement>,
        has_deviations: bool,
    ) {
        let plan = &self.plan;
        // Learning uses the points as they were sent, a solver uses them merged.
        let as_sent = |point: usize| plan.merge.as_ref().map_or(point, |merge| merge.first_point(point));
        let of_solution = of_solution.map(|found| {
            let outlier = found.outlier.map(|found| Outlier { point: as_sent(found.point), ..found });
            Disagreement { outlier, ..found }
        });
        let is_learned = plan.process.is_learned;
        let found = of_solution.or_else(|| plan.disagreement());
        let Some(found) = found.filter(|_| is_learned || has_deviations) else { return };
        let remedy = if is_learned { POOR_FIT_OF_LEARNED } else { POOR_FIT_OF_GIVEN };
        diagnostics.warn_of_poor_fit(found, remedy);
    }
}

/// Returns the warning of rows that count once.
pub fn repeated_rows(n_copies: usize) -> Warning {
    let detail = format!(
        "rows that repeat point and values of an earlier one: {n_copies}; with the noise left to the values they count once; \
         give alpha if they were measured"
    );
    Warning { code: WarningCode::RepeatedRows, detail }
}

/// Least ratio of the spreads of two coordinates that are worth a warning.
const UNITS: f64 = 10.0;

/// Says which coordinates of a cloud have the most different spreads, if one length scale was learned for
/// all.
fn units_differ(cloud: &Cloud) -> Option<String> {
    let (least, most) = cloud.bounding_box();
    let spreads = || most.iter().zip(&least).map(|(most, least)| most - least).enumerate();
    let varying = || spreads().filter(|(_, spread)| *spread > 0.0);
    let (widest, most) = varying().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let (narrowest, least) = varying().min_by(|a, b| a.1.total_cmp(&b.1))?;
    (most > UNITS * least).then(|| {
        format!(
            "coordinate {widest} of the points varies {:.0} times as much as coordinate {narrowest}, and one length scale was learned \
             for all; if their units differ, scale them, or send kernel.length_scales, which /v1/model-selection finds",
            most / least
        )
    })
}
