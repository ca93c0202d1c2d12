//! `POST /v1/posterior`: the Gaussian process posterior of values at the points of a cloud.

mod batch;
mod work;

use serde::Deserialize;
use utoipa::ToSchema;

use crate::http::fields::{Diagnostics, Fit, MeanChoice, request};
use crate::http::problem::Problem;
use crate::http::routes::operation::operation;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::{Operation, Plan};
use crate::http::serve::planner::{GivenValues, Planner, ValuesUse};
pub use batch::*;
use gramian_host::answer;
use gramian_host::compute::JobObserver;
use gramian_host::wire::read::members::present_unless_empty;
use gramian_host::wire::read::points::Points;
use gramian_host::wire::write::array::Array;
use work::{PosteriorArrays, PosteriorParts, Work};

/// Optional parts of a posterior, beside its mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PosteriorQuantity {
    /// The variance of the latent function at each query.
    Variances,
    /// The variance of a new observation at each query: the variance of the latent function plus alpha.
    ObservationVariances,
    /// The covariance of the latent function between queries.
    Covariance,
    /// The gradient of the mean at each query.
    Gradients,
    /// The variances of the components of the latent function's gradient at each query.
    GradientVariances,
    /// The logarithm of the probability density of the values.
    LogMarginalLikelihood,
}

/// The random quantity that samples, quantiles and probabilities are of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PosteriorTarget {
    /// The latent function.
    #[default]
    Function,
    /// A new observation: the latent function plus independent noise of variance alpha.
    Observation,
}

/// Functions to draw from the posterior: their number and a seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SampleOptions {
    /// Number of functions to draw.
    #[schema(minimum = 1)]
    pub count: usize,
    /// The seed of the draws. Default: 0.
    ///
    /// Equal seeds give equal draws on processors of one kind. A larger `count` begins with the draws of a
    /// smaller one.
    #[serde(default)]
    #[schema(minimum = 0, maximum = 9007199254740991u64)]
    pub seed: u64,
}

request! {
    /// Noisy values at the points of a cloud, and queries for the posterior.
    pub struct PosteriorRequest {
        /// The observed values at the points, in their order.
        #[schema(min_items = 1)]
        pub values: Vec<f64>,
        /// The mean of the process. Default: a constant if `kernel` is absent too, else 0.
        pub mean: Option<MeanChoice>,
        /// The points to evaluate at, one row of coordinates each. Default: the points of the cloud.
        #[schema(value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
        pub queries: Option<Points>,
        /// Optional parts of the answer beside the mean. Default: none.
        pub include: Option<Vec<PosteriorQuantity>>,
        /// Joint draws at all queries. Default: none.
        pub samples: Option<SampleOptions>,
        /// Probabilities between 0 and 1 for quantiles. Default: none.
        ///
        /// An empty list counts as absent.
        #[serde(default, deserialize_with = "present_unless_empty")]
        #[schema(max_items = 1000)]
        pub quantiles: Option<Vec<f64>>,
        /// The threshold of `exceedance_probabilities`, unit of the values.
        pub threshold: Option<f64>,
        /// The random quantity of samples, quantiles and probabilities of exceedance. Default: `function`.
        ///
        /// `observation` needs `alpha`: with `noise_variances` the noise at queries is unknown.
        pub of: Option<PosteriorTarget>,
    }
}

answer! {
    /// The Gaussian process given the values.
    pub struct PosteriorResponse {
        /// The posterior mean at each query, unit of the values.
        means: Array as Vec<f64>,
        /// The variance of the latent function at each query, no noise added, unit of the values squared.
        variances: Option<Array> as Option<Vec<f64>>,
        /// The variance of a new observation at each query.
        observation_variances: Option<Array> as Option<Vec<f64>>,
        /// The covariance of the latent function between queries.
        covariance: Option<Array> as Option<Vec<Vec<f64>>>,
        /// The gradient of the mean at each query, unit of the values per length.
        gradients: Option<Array> as Option<Vec<Vec<f64>>>,
        /// The variances of the components of the latent function's gradient at each query.
        gradient_variances: Option<Array> as Option<Vec<Vec<f64>>>,
        /// Draws of what `of` names. A draw is a row, with a number per query.
        samples: Option<Array> as Option<Vec<Vec<f64>>>,
        /// Quantiles of what `of` names. A probability is a row, with a number per query.
        quantiles: Option<Array> as Option<Vec<Vec<f64>>>,
        /// The probability that what `of` names exceeds `threshold`, at each query.
        exceedance_probabilities: Option<Array> as Option<Vec<f64>>,
        /// The log marginal likelihood of the values, −½YᵀΛ − ½ ln det(K + αI) − ½n ln 2π.
        log_marginal_likelihood: Option<f64>,
        /// The numbers used, the method, its accuracy, and warnings.
        diagnostics: Diagnostics,
    }
}

operation! {
/// Compute the Gaussian process posterior
///
/// Returns the posterior mean at the queries. The kernel is the prior covariance, and alpha (or
/// noise_variances) is the variance of the noise. On request, the answer also has variances, covariance,
/// gradients with their variances, quantiles, probabilities of exceedance, joint samples and the log marginal
/// likelihood.
///
/// With `"solver": "local"`, and for clouds that are too large to be factorized, each query is answered from
/// the points nearest to it. Covariance, samples and likelihood need all points or queries together, so they
/// are then not available.
pub async fn compute_posterior(PosteriorRequest) -> PosteriorResponse;
path: "/v1/posterior", tag: "values", answer: "The posterior at the queries"
}

impl Operation for PosteriorRequest {
    type Work = Work;

    fn values_use(&self) -> ValuesUse {
        ValuesUse::Alone
    }

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<Work>, Problem> {
        let given = GivenValues::one(std::mem::take(&mut self.values));
        let fit = Fit { mean: self.mean, ..self.take_fit() };
        let Self { include, samples, quantiles, threshold, of, queries, .. } = self;
        let (include, of) = (include.unwrap_or_default(), of.unwrap_or_default());
        let asked = PosteriorParts { include, samples, quantiles, threshold, of };
        Work::plan(planner, fit, given, queries, asked)
    }

    fn compute(work: Work, fits: &Fits, observer: &JobObserver) -> Result<PosteriorResponse, Problem> {
        let found = PosteriorArrays::one(work, fits, observer)?;
        Ok(PosteriorResponse {
            means: found.means,
            variances: found.variances,
            observation_variances: found.observation_variances,
            covariance: found.covariance,
            gradients: found.gradients,
            gradient_variances: found.gradient_variances,
            samples: found.samples,
            quantiles: found.quantiles,
            exceedance_probabilities: found.exceedance_probabilities,
            log_marginal_likelihood: found.log_marginal_likelihoods.first().copied(),
            diagnostics: found.diagnostics,
        })
    }
}
