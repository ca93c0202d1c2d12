//! `POST /v1/model-selection`: the kernel and the noise that explain values best.

mod rows;
mod search;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::http::fields::{Diagnostics, DuplicatePolicy, Fit, KernelFamily, KernelUsed, MeanChoice, request};
use crate::http::problem::Problem;
use crate::http::problem::catalogue;
use crate::http::routes::operation::operation;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::{Operation, Plan};
use crate::http::serve::plan::Cost;
use crate::http::serve::planner::{GivenValues, Planner, RestrictedQuantity};
use gramian_host::compute::JobObserver;
use gramian_host::wire::write::array::Array;
use gramian_host::wire::write::json::Nullable;
use gramian_host::{answer, json_members};
use gramian_numerics::error::SolverKind;
use search::{Search, Work};

/// The score that a selection maximizes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SelectionCriterion {
    /// The log marginal likelihood of the values, −½YᵀΛ − ½ ln det(K + αI) − ½n ln 2π.
    #[default]
    MarginalLikelihood,
    /// The sum over all values of the log predictive density of the value given all others.
    LeaveOneOut,
    /// −n|Y − Ŷ|²/tr(I − H)², Ŷ = HY. It depends only on the ratio of variance and alpha.
    GeneralizedCrossValidation,
}

/// A parameter that may be free.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SelectionParameter {
    /// The length scale of the kernel.
    LengthScale,
    /// A length scale per axis: that of one axis, or those of all axes.
    LengthScales,
    /// The variance of the kernel.
    Variance,
    /// The variance of the noise.
    Alpha,
    /// The parameter epsilon of the Laplace family.
    Epsilon,
    /// The smoothness ν of the Matérn family. Each half-integer within the bounds is tried.
    Nu,
}

/// A parameter that is free between bounds.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FreeParameter {
    /// The parameter.
    pub parameter: SelectionParameter,
    /// The axis, from 0, for `length_scales` only. Default: every axis, each within these bounds.
    #[schema(minimum = 0)]
    pub axis: Option<usize>,
    /// The lower bound.
    #[schema(exclusive_minimum = 0.0)]
    pub min: f64,
    /// The upper bound.
    #[schema(exclusive_minimum = 0.0)]
    pub max: f64,
}

request! {
    /// Values at the points of a cloud, and the parameters that may vary to explain them.
    ///
    /// The search begins with `kernel` and `alpha`.
    pub struct ModelSelectionRequest {
        /// The values at the points, in their order.
        #[schema(min_items = 1)]
        pub values: Vec<f64>,
        /// The mean of the function. Default: a constant if `kernel` is absent too, else 0.
        pub mean: Option<MeanChoice>,
        /// The score to maximize. Default: the marginal likelihood.
        pub criterion: Option<SelectionCriterion>,
        /// The free parameters and their bounds, at most 64 entries. Default: length scale, variance, alpha.
        ///
        /// By default, length scale and variance may become up to a hundred times smaller or larger than at
        /// the start. If `kernel` has a length scale per axis, each of them varies. Alpha varies unless noise
        /// is given for each point. Its lower bound is a millionth of its start, or of a millionth of the
        /// variance if that is more. Its upper bound is a hundred times its start, or a hundred times the
        /// variance if that is more.
        ///
        /// Where length scales of axes vary, the jointly robust prior (Gu 2019) keeps them from fitting
        /// noise. The search then maximizes the criterion plus the logarithm of the prior.
        pub vary: Option<Vec<FreeParameter>>,
        /// Kernel families to try. Default: that of the start, and `matern` if `nu` varies.
        ///
        /// A family takes the parameters of `kernel` if `kernel` is of that family.
        pub families: Option<Vec<KernelFamily>>,
        /// Number of further starts for each family, spread over the bounds. Default: 2.
        ///
        /// With more than 768 points, starts are compared on a sample of them first.
        #[schema(minimum = 0, maximum = 100)]
        pub restarts: Option<u8>,
        /// The seed that determines the further starts. Default: 0.
        #[schema(minimum = 0, maximum = 9007199254740991u64)]
        pub seed: Option<u64>,
    }
}

/// The score at one alpha, with everything else as selected.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
pub struct AlphaScore {
    /// The variance of the noise, α.
    pub alpha: f64,
    /// The score. Null where the matrix is not positive definite.
    #[schema(value_type = Option<f64>, nullable = true)]
    pub score: Nullable,
}

/// Predictions of each value from all others. A row that counts once with another has its prediction.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct LeaveOneOutPredictions {
    /// The predictions, in the order of the points. Null where the mean is not determined without the point.
    #[schema(value_type = Vec<Option<f64>>)]
    pub means: Vec<Nullable>,
    /// The variances of the predicted values, noise included.
    #[schema(value_type = Vec<Option<f64>>)]
    pub variances: Vec<Nullable>,
    /// The logarithms of the densities of the values under their predictions.
    #[schema(value_type = Vec<Option<f64>>)]
    pub log_predictive_densities: Vec<Nullable>,
}

json_members!(LeaveOneOutPredictions);

/// The best score of a family.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct FamilyScore {
    /// The kernel family.
    pub family: KernelFamily,
    /// The smoothness ν of the Matérn family. Absent for other families.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nu: Option<f64>,
    /// The best score of the family. Null if the matrix was not positive definite from any start.
    #[schema(value_type = Option<f64>, nullable = true)]
    pub score: Nullable,
}

answer! {
    /// The selected kernel and noise, with scores and predictions.
    pub struct ModelSelectionResponse {
        /// The selected kernel. Sent as `kernel` of a request, it is used as it is.
        kernel: KernelUsed,
        /// The selected variance of the noise. Absent with `noise_variances`.
        alpha: Option<f64>,
        /// The mean of the function: the constant, then a slope per coordinate if it is linear. Absent if the
        /// mean is 0.
        mean_coefficients: Option<Array> as Option<Vec<f64>>,
        /// The score of the selection by the criterion alone, without a prior. Greater is better.
        score: f64,
        /// Derivatives of the score in the logarithms of the free parameters, in the order of `vary`.
        ///
        /// They are those of the criterion alone. Where length scales of axes vary, the prior may balance
        /// them. For `length_scales` without an axis, the derivative is in the logarithm of a common factor
        /// of all length scales. Null for `nu`, which takes steps.
        score_gradient: Vec<Nullable> as Vec<Option<f64>>,
        /// True if no slope is left to follow within the bounds.
        converged: bool,
        /// Number of evaluations of the score.
        evaluations: usize,
        /// The families that were tried.
        families: Vec<FamilyScore>,
        /// The score over ascending alpha, with everything else as selected.
        ///
        /// Empty with `noise_variances`, and for more than 3,000 points.
        alpha_path: Vec<AlphaScore>,
        /// Predictions of each value from all others, in closed form.
        leave_one_out: LeaveOneOutPredictions,
        /// Diagnostics of the fit that the search began with.
        diagnostics: Diagnostics,
    }
}

operation! {
/// Select a model
///
/// Searches the kernel and the noise that explain the values best, by marginal likelihood, leave-one-out or
/// generalized cross-validation. The search starts from the kernel of the request, or from a learned one if
/// the request has none, and from further starts. It uses sequential quadratic programming with exact slopes
/// within bounds.
///
/// The answer has the selection, the score over alpha, and predictions of each value from all others. Every
/// evaluation costs a few factorizations, so clouds may have at most 5,000 points. For larger clouds, select
/// on a sample of the points, and send the result with all of them.
pub async fn select_model(ModelSelectionRequest) -> ModelSelectionResponse;
path: "/v1/model-selection", tag: "values", answer: "What explains the values best"
}

/// Number of α on a path.
const N_ALPHAS: usize = 61;

/// Largest number of points with a path.
///
/// A path takes too long beyond it.
const MAX_PATH_POINTS: usize = 3000;

/// Largest number of points in a model selection.
///
/// A hundred factorizations take minutes at this size.
const MAX_POINTS: usize = 5000;

impl Operation for ModelSelectionRequest {
    type Work = Work;

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<Work>, Problem> {
        let search = Search::of(&self)?;
        if self.duplicates == Some(DuplicatePolicy::Merge) {
            let detail = "cross-validation leaves out points of the cloud, so they cannot be merged here: merge coinciding points before sending";
            return Err(Problem::invalid_request("/duplicates", detail));
        }
        let given = GivenValues::one(std::mem::take(&mut self.values));
        let fit = Fit { mean: self.mean, ..self.take_fit() };
        let restricted = RestrictedQuantity {
            name: "model selection",
            pointer: "/solver",
            without: &[SolverKind::Local, SolverKind::Iterative],
        };
        let (mut main, values) = planner.values_fit(fit, given, Some(restricted))?;
        planner.queries(None, &mut main.on)?;
        let (n, d) = (main.on.n_points(), main.on.stored.cloud.dimension());
        if n > MAX_POINTS {
            let problem = Problem::too_large(
                catalogue::PROBLEM_TOO_LARGE,
                "points in a model selection",
                MAX_POINTS,
                Some(n),
            );
            let remedy =
                "select on a sample of the points, then send the selected parameters with all of them";
            return Err(problem.at(main.on.pointers.points).with_remedy(remedy));
        }
        search.check_axes_of(d)?;
        let n_numbers = planner.check_answer(n.checked_mul(3).and_then(|n| n.checked_add(4 * N_ALPHAS)))?;
        let cost = Cost { work: search.price(n, d, main.n_length_scales()), n_numbers, n_held: n };
        Ok(Plan::of_values(main, Work { values, search }, cost))
    }

    fn compute(work: Work, fits: &Fits, observer: &JobObserver) -> Result<ModelSelectionResponse, Problem> {
        work.run(fits, observer)
    }
}
