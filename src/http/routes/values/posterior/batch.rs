//! `POST /v1/posterior/batch`: Gaussian process posteriors of many lists of values, with one factorization.

use super::work::{PosteriorArrays, PosteriorParts, Work};
use super::{PosteriorQuantity, PosteriorTarget, SampleOptions};
use crate::http::fields::{Diagnostics, Fit, MeanChoice, request};
use crate::http::problem::Problem;
use crate::http::routes::operation::operation;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::{Operation, Plan};
use crate::http::serve::planner::{Planner, ValuesUse, value_lists};
use gramian_host::answer;
use gramian_host::compute::JobObserver;
use gramian_host::wire::read::members::present_unless_empty;
use gramian_host::wire::read::points::{Points, ValueLists};
use gramian_host::wire::write::array::Array;

request! {
    /// Many lists of noisy values at the points of a cloud, and queries for their posteriors.
    pub struct PosteriorBatchRequest {
        /// Lists of observed values. Each has a value per point, in the order of the points.
        ///
        /// All lists have kernel and noise in common.
        #[schema(value_type = Vec<Vec<f64>>, min_items = 1)]
        pub values: ValueLists,
        /// The mean of each process. Default: a constant if `kernel` is absent too, else 0.
        pub mean: Option<MeanChoice>,
        /// The points to evaluate at, one row of coordinates each. Default: the points of the cloud.
        #[schema(value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
        pub queries: Option<Points>,
        /// Optional parts of the answer beside the means. Default: none.
        pub include: Option<Vec<PosteriorQuantity>>,
        /// Joint draws at all queries for each list. Default: none.
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
    /// The Gaussian processes given the values.
    ///
    /// Each list has its own rows in everything that depends on its values. The lists share the rest.
    pub struct PosteriorBatchResponse {
        /// The posterior mean at each query, a row per list.
        means: Array as Vec<Vec<f64>>,
        /// The variance of the latent functions at each query.
        variances: Option<Array> as Option<Vec<f64>>,
        /// The variance of a new observation at each query.
        observation_variances: Option<Array> as Option<Vec<f64>>,
        /// The covariance of the latent functions between queries.
        covariance: Option<Array> as Option<Vec<Vec<f64>>>,
        /// The gradient of the mean at each query, for each list.
        gradients: Option<Array> as Option<Vec<Vec<Vec<f64>>>>,
        /// The variances of the components of the latent functions' gradients at each query.
        gradient_variances: Option<Array> as Option<Vec<Vec<f64>>>,
        /// Draws of what `of` names for each list. A draw is a row, with a number per query.
        samples: Option<Array> as Option<Vec<Vec<Vec<f64>>>>,
        /// Quantiles of what `of` names for each list. A probability is a row, with a number per query.
        quantiles: Option<Array> as Option<Vec<Vec<Vec<f64>>>>,
        /// The probability that what `of` names exceeds `threshold` at each query, a row per list.
        exceedance_probabilities: Option<Array> as Option<Vec<Vec<f64>>>,
        /// The log marginal likelihood of each list, −½YᵀΛ − ½ ln det(K + αI) − ½n ln 2π.
        log_marginal_likelihoods: Option<Vec<f64>>,
        /// The mean of each function, a row per list. Absent if the mean is 0.
        ///
        /// A row is the constant, followed by a slope per coordinate if the mean is linear.
        mean_coefficients: Option<Array> as Option<Vec<Vec<f64>>>,
        /// The numbers used, the method, its accuracy, and warnings. `relative_residual` is the largest of
        /// all lists.
        diagnostics: Diagnostics,
    }
}

operation! {
/// Compute Gaussian process posteriors of many lists of values
///
/// Computes the posterior of each list as `/v1/posterior` does, with one factorization for all lists. A
/// kernel that is not given is learned from all lists together. Batches need the dense solver.
pub async fn compute_posterior_batch(PosteriorBatchRequest) -> PosteriorBatchResponse;
path: "/v1/posterior/batch", tag: "values", answer: "The posteriors at the queries"
}

impl Operation for PosteriorBatchRequest {
    type Work = Work;

    fn values_use(&self) -> ValuesUse {
        ValuesUse::Alone
    }

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<Work>, Problem> {
        let given = value_lists(std::mem::take(&mut self.values))?;
        let fit = Fit { mean: self.mean, ..self.take_fit() };
        let Self { include, samples, quantiles, threshold, of, queries, .. } = self;
        let (include, of) = (include.unwrap_or_default(), of.unwrap_or_default());
        let asked = PosteriorParts { include, samples, quantiles, threshold, of };
        Work::plan(planner, fit, given, queries, asked)
    }

    fn compute(work: Work, fits: &Fits, observer: &JobObserver) -> Result<PosteriorBatchResponse, Problem> {
        let found = PosteriorArrays::each(work, fits, observer)?;
        Ok(PosteriorBatchResponse {
            means: found.means,
            variances: found.variances,
            observation_variances: found.observation_variances,
            covariance: found.covariance,
            gradients: found.gradients,
            gradient_variances: found.gradient_variances,
            samples: found.samples,
            quantiles: found.quantiles,
            exceedance_probabilities: found.exceedance_probabilities,
            log_marginal_likelihoods: Some(found.log_marginal_likelihoods).filter(|all| !all.is_empty()),
            mean_coefficients: found.mean_coefficients,
            diagnostics: found.diagnostics,
        })
    }
}
