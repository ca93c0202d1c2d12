//! `POST /v1/posterior`.

use std::sync::Arc;

use axum::Extension;
use axum::extract::{Request, State};
use axum::response::Response;
use serde::Deserialize;
use utoipa::ToSchema;

use crate::http::compute::JobObserver;
use crate::http::fields::{Diagnostics, Fit, MeanChoice, Warning, WarningCode, request};
use crate::http::openapi::responses::ComputeProblems;
use crate::http::problem::Problem;
use crate::http::serve::app::App;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::{Operation, Plan, serve};
use crate::http::serve::plan::Cost;
use crate::http::serve::plan::PlannedFit;
use crate::http::serve::planner::{DenseOnly, Planner};
use crate::http::serve::values::{ValuesAt, ValuesRequest};
use crate::http::wire::read::members::{present, present_word, present_words};
use crate::http::wire::read::points::Points;
use crate::http::wire::write::answer::answer;
use crate::http::wire::write::array::Array;
use crate::numerics::function::interpolant::Interpolant;
use crate::numerics::function::posterior::{covariance_with_mean, log_marginal_likelihood};
use crate::numerics::points::cloud::Cloud;
use crate::numerics::solver::choose::{Asked, work_price};
use crate::numerics::sums::jets::JetOrder;
use crate::store::Owner;

/// What may be asked of a posterior beside its mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PosteriorQuantity {
    /// The variance of the latent function at each query.
    Variance,
    /// The variance of a new observation at each query: the latent one plus alpha.
    ObservationVariance,
    /// The covariance of the latent function between queries.
    Covariance,
    /// The gradient of the mean at each query.
    Gradients,
    /// The logarithm of the probability density of the values.
    LogMarginalLikelihood,
}

request! {
    /// Noisy values at the points of a cloud, and where the posterior is wanted.
    pub struct PosteriorRequest {
        /// The observed values at the points, in their order.
        #[schema(min_items = 1)]
        pub values: Vec<f64>,
        /// The mean of the process; a constant if absent with the kernel, else 0.
        #[serde(default, deserialize_with = "present_word")]
        #[schema(nullable = false)]
        pub mean: Option<MeanChoice>,
        /// Where answers are wanted; the points of the cloud if absent.
        #[serde(default, deserialize_with = "present")]
        #[schema(nullable = false, value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
        pub queries: Option<Points>,
        /// What is wanted beside the mean; nothing if absent.
        #[serde(default, deserialize_with = "present_words")]
        #[schema(nullable = false)]
        pub include: Option<Vec<PosteriorQuantity>>,
    }
}

answer! {
    /// The Gaussian process given the values.
    pub struct PosteriorResponse {
        /// The posterior mean at each query, unit of the values.
        #[schema(value_type = Vec<f64>)]
        means: Array,
        /// The variance of the latent function at each query, no noise added, unit of the values squared.
        #[schema(nullable = false, value_type = Option<Vec<f64>>)]
        variances: Option<Array>,
        /// The variance of a new observation at each query.
        #[schema(nullable = false, value_type = Option<Vec<f64>>)]
        observation_variances: Option<Array>,
        /// The covariance of the latent function between queries.
        #[schema(nullable = false, value_type = Option<Vec<Vec<f64>>>)]
        covariance: Option<Array>,
        /// The gradient of the mean at each query, unit of the values per length.
        #[schema(nullable = false, value_type = Option<Vec<Vec<f64>>>)]
        gradients: Option<Array>,
        /// −½YᵀΛ − ½ ln det(K + αI) − ½n ln 2π.
        #[schema(nullable = false)]
        log_marginal_likelihood: Option<f64>,
        /// How the answer came about.
        diagnostics: Diagnostics,
    }
}

/// Compute the Gaussian process posterior
///
/// With the kernel as prior covariance and alpha (or noise_variances) as the variance of the noise: the posterior mean at the
/// queries and, if asked for, variances, covariance, gradients and the log marginal likelihood. With `"solver": "local"`, and beyond the points
/// that are factorized, each query is answered from the points nearest to it, without covariance and likelihood.
#[utoipa::path(
    post,
    path = "/v1/posterior",
    operation_id = "compute_posterior",
    tag = "values",
    request_body = PosteriorRequest,
    responses((status = 200, description = "The posterior at the queries", body = PosteriorResponse), ComputeProblems),
    security((), ("bearer" = []))
)]
pub async fn compute_posterior(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    request: Request,
) -> Result<Response, Problem> {
    serve::<PosteriorRequest>(app, owner, request).await
}

/// A checked request.
pub struct Work {
    values: Arc<Vec<f64>>,
    queries: Arc<Cloud>,
    include: Vec<PosteriorQuantity>,
}

impl Work {
    fn wants(&self, quantity: PosteriorQuantity) -> bool {
        self.include.contains(&quantity)
    }
}

impl Operation for PosteriorRequest {
    type Work = Work;
    type Answer = PosteriorResponse;
    const HAS_SURFACE: bool = false;

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<Work>, Problem> {
        let values = Arc::new(std::mem::take(&mut self.values));
        let fit = Fit { values: Some(values.clone()), mean: self.mean, ..self.take_fit() };
        let include = self.include.unwrap_or_default();
        let mut main = planner.values_fit(fit, dense_only(&include))?;
        let queries = planner.queries(self.queries, &mut [&mut main])?;
        let work = Work { values, queries, include };
        check_observation_noise(&work, &main)?;
        let (n, m, d) = (main.n_points(), work.queries.n_points(), work.queries.dimension());
        let has_covariance = work.wants(PosteriorQuantity::Covariance);
        let n_numbers = planner.check_answer(m.checked_mul(d + 3 + if has_covariance { m } else { 0 }))?;
        let variances =
            work.wants(PosteriorQuantity::Variance) || work.wants(PosteriorQuantity::ObservationVariance);
        let asked = match main.is_moving() {
            true => Asked::Moving,
            false => Asked::Posterior { variances, covariance: has_covariance },
        };
        let n_held = n + m * d;
        Ok(Plan {
            main,
            surface: None,
            work,
            cost: Cost { work: work_price(asked, n, m, d), n_numbers, n_held },
        })
    }

    fn compute(work: Work, fits: &Fits, observer: &JobObserver) -> Result<PosteriorResponse, Problem> {
        use PosteriorQuantity as Q;
        let refused = |error| fits.main.refused(error);
        let (values, queries) = (&work.values, &work.queries);
        let order = if work.wants(Q::Gradients) { JetOrder::Gradient } else { JetOrder::Value };
        let has_variances = work.wants(Q::Variance) || work.wants(Q::ObservationVariance);
        let asked = ValuesRequest { values, queries, order, has_variances };
        let ValuesAt { jets, variances: latent, mut diagnostics, interpolant } =
            fits.values_at(asked, observer)?;
        let (m, d) = (jets.n_queries(), jets.dimension());
        let scale = fits.main.plan.scale;
        let dense = || interpolant.as_ref().ok_or_else(Problem::internal);
        let covariance = match work.wants(Q::Covariance) {
            false => None,
            true => {
                let Interpolant { solver, solution } = dense()?;
                let found = covariance_with_mean(solver, solution.trend.as_ref(), queries, observer);
                Some(found.map_err(refused)?.scaled(scale))
            }
        };
        let clamped = latent.as_ref().map(|v| &v.clamped).or(covariance.as_ref().map(|c| &c.clamped));
        warn_of_clamping(clamped.map_or(&[], Vec::as_slice), &mut diagnostics);
        let log_marginal_likelihood = match work.wants(Q::LogMarginalLikelihood) {
            false => None,
            true => {
                let dense = dense()?;
                Some(log_marginal_likelihood(&dense.solver, &dense.solution, scale).map_err(refused)?)
            }
        };
        // With noise per point it is not asked for.
        let alpha = diagnostics.alpha.unwrap_or_default();
        let of_latent = |quantity, noise: f64| {
            let latent = latent.as_ref().filter(|_| work.wants(quantity))?;
            Some(Array::new(latent.latent.iter().map(|v| v + noise).collect(), &[m]))
        };
        Ok(PosteriorResponse {
            means: Array::new(jets.values(), &[m]),
            variances: of_latent(Q::Variance, 0.0),
            observation_variances: of_latent(Q::ObservationVariance, alpha),
            covariance: covariance.map(|covariance| Array::new(covariance.latent, &[m, m])),
            gradients: work.wants(Q::Gradients).then(|| Array::new(jets.gradients(), &[m, d])),
            log_marginal_likelihood,
            diagnostics,
        })
    }
}

/// What is asked that only a dense factorization has.
fn dense_only(include: &[PosteriorQuantity]) -> Option<DenseOnly> {
    let name = include.iter().find_map(|quantity| match quantity {
        PosteriorQuantity::Covariance => Some("covariance"),
        PosteriorQuantity::LogMarginalLikelihood => Some("log_marginal_likelihood"),
        PosteriorQuantity::Variance
        | PosteriorQuantity::ObservationVariance
        | PosteriorQuantity::Gradients => None,
    })?;
    Some(DenseOnly { name, pointer: "/include" })
}

/// A new observation's noise is only known if it is the same everywhere.
fn check_observation_noise(work: &Work, plan: &PlannedFit) -> Result<(), Problem> {
    if !plan.has_noise_variances() || !work.wants(PosteriorQuantity::ObservationVariance) {
        return Ok(());
    }
    let detail = "observation_variance needs alpha: with noise_variances the noise at queries is unknown";
    Err(Problem::invalid_request("/include", detail))
}

fn warn_of_clamping(clamped: &[usize], diagnostics: &mut Diagnostics) {
    let Some(first) = clamped.first() else { return };
    let count = clamped.len();
    diagnostics.warnings.push(Warning {
        code: WarningCode::VarianceClamped,
        detail: format!(
            "{count} variances came out negative within rounding, first at query {first}; served as 0"
        ),
    });
}
