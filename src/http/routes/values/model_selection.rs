//! `POST /v1/model-selection`.

mod search;

use std::sync::Arc;

use axum::Extension;
use axum::extract::{Request, State};
use axum::response::Response;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::http::compute::JobObserver;
use crate::http::fields::{Diagnostics, DuplicatePolicy, Fit, KernelFamily, KernelUsed, MeanChoice, request};
use crate::http::openapi::responses::ComputeProblems;
use crate::http::problem::Problem;
use crate::http::problem::slug::Slug;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::{Operation, Plan, serve};
use crate::http::serve::plan::Cost;
use crate::http::serve::planner::{DenseOnly, GivenValues, Planner};
use crate::http::state::app::App;
use crate::http::wire::read::members::{present, present_word, present_words, word};
use crate::http::wire::write::answer::{Member, Parts, answer};
use crate::http::wire::write::array::Array;
use crate::http::wire::write::json::Nullable;
use crate::store::Owner;
use search::{Search, Work};

/// What is made as great as possible.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SelectionCriterion {
    /// The log marginal likelihood of the values, −½YᵀΛ − ½ ln det(K + αI) − ½n ln 2π.
    #[default]
    MarginalLikelihood,
    /// The sum of the log predictive densities of each value given all others.
    LeaveOneOut,
    /// Minus n|Y − Ŷ|²/tr(I − H)², Ŷ = HY: variance and alpha only count by their ratio.
    GeneralizedCrossValidation,
}

/// What may be free.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SelectionParameter {
    /// The length scale of the kernel.
    LengthScale,
    /// The length scale of one axis, or of every axis its own.
    LengthScales,
    /// The variance of the kernel.
    Variance,
    /// The variance of the noise.
    Alpha,
    /// epsilon of the Laplace family.
    Epsilon,
    /// ν of the Matérn family: each half-integer within the bounds is tried.
    Nu,
}

/// A parameter that is free between bounds.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FreeParameter {
    /// Which.
    #[serde(deserialize_with = "word")]
    pub parameter: SelectionParameter,
    /// length_scales: the axis, from 0; every axis if absent, each within these bounds.
    #[serde(default, deserialize_with = "present")]
    #[schema(nullable = false, minimum = 0)]
    pub axis: Option<usize>,
    /// The least that it may be.
    #[schema(exclusive_minimum = 0.0)]
    pub min: f64,
    /// The greatest that it may be.
    #[schema(exclusive_minimum = 0.0)]
    pub max: f64,
}

request! {
    /// Values at the points of a cloud, and what may be chosen to explain them. The search begins with `kernel` and `alpha`.
    pub struct ModelSelectionRequest {
        /// The values at the points, in their order.
        #[schema(min_items = 1)]
        pub values: Vec<f64>,
        /// The mean of the function; a constant if absent with the kernel, else 0.
        #[serde(default, deserialize_with = "present_word")]
        #[schema(nullable = false)]
        pub mean: Option<MeanChoice>,
        /// What is made as great as possible; the marginal likelihood if absent.
        #[serde(default, deserialize_with = "present_word")]
        #[schema(nullable = false)]
        pub criterion: Option<SelectionCriterion>,
        /// What is free, and its bounds; 64 entries at most. Absent: length scale, or that of each axis where `kernel` has them, and variance, from a
        /// hundredth to a hundred times of where the search begins; and alpha, unless noise is given for each point, from a millionth of where it begins, or
        /// of a millionth of the variance if that is more, to a hundred times the variance.
        #[serde(default, deserialize_with = "present")]
        #[schema(nullable = false)]
        pub vary: Option<Vec<FreeParameter>>,
        /// Families to try, with the parameters of `kernel` where it is of that family; that of the start alone if absent, and matern where nu varies.
        #[serde(default, deserialize_with = "present_words")]
        #[schema(nullable = false)]
        pub families: Option<Vec<KernelFamily>>,
        /// Further starts for each family, spread over the bounds; 2 if absent.
        #[serde(default, deserialize_with = "present")]
        #[schema(nullable = false, minimum = 0, maximum = 100)]
        pub restarts: Option<u8>,
        /// Where the further starts are; 0 if absent.
        #[serde(default, deserialize_with = "present")]
        #[schema(nullable = false, minimum = 0, maximum = 9007199254740991u64)]
        pub seed: Option<u64>,
    }
}

/// The criterion at one alpha, all else being as it was selected.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
pub struct PathEntry {
    /// α.
    pub alpha: f64,
    /// The score; null where the matrix is not positive definite.
    #[schema(value_type = Option<f64>, nullable = true)]
    pub score: Nullable,
}

/// What each value is predicted to be from all others.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct LeftOut {
    /// The predictions, in the order of the points; null where the mean is not determined without the point.
    #[schema(value_type = Vec<Option<f64>>)]
    pub means: Vec<Nullable>,
    /// The variances of the values predicted, their noise included.
    #[schema(value_type = Vec<Option<f64>>)]
    pub variances: Vec<Nullable>,
    /// The logarithms of the densities of the values under their predictions.
    #[schema(value_type = Vec<Option<f64>>)]
    pub log_predictive_densities: Vec<Nullable>,
}

impl Member for LeftOut {
    fn add_to(self, name: &'static str, parts: &mut Parts) -> Result<(), Problem> {
        parts.add_json(name, &self)
    }
}

/// The best score of a family.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct FamilyScore {
    /// The kernel family, with ν where it is Matérn.
    pub family: KernelFamily,
    /// matern: the smoothness ν.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub nu: Option<f64>,
    /// Its best score; null where the matrix was not positive definite from any start.
    #[schema(value_type = Option<f64>, nullable = true)]
    pub score: Nullable,
}

answer! {
    /// What explains the values best.
    pub struct ModelSelectionResponse {
        /// The kernel that was selected: sent as `kernel` it is used.
        kernel: KernelUsed,
        /// The variance of the noise that was selected; absent with `noise_variances`.
        #[schema(nullable = false)]
        alpha: Option<f64>,
        /// The mean of the function: the constant, then a slope for each coordinate if it is linear; absent where it is 0.
        #[schema(nullable = false, value_type = Option<Vec<f64>>)]
        mean_coefficients: Option<Array>,
        /// The criterion there; greater is better.
        score: f64,
        /// Derivatives of the score in the logarithms of what is free, in the order of `vary`; for `length_scales` without an axis, in that of a factor
        /// of all; null for nu, which takes steps.
        #[schema(value_type = Vec<Option<f64>>)]
        gradient: Vec<Nullable>,
        /// Whether no slope is left to follow within the bounds.
        converged: bool,
        /// How often the criterion was evaluated.
        evaluations: usize,
        /// The families that were tried.
        families: Vec<FamilyScore>,
        /// The criterion over alpha, ascending, all else being as selected; empty with `noise_variances`, and beyond 3,000 points.
        path: Vec<PathEntry>,
        /// Each value predicted from all others, in closed form.
        leave_one_out: LeftOut,
        /// Of the fit that the search began with.
        diagnostics: Diagnostics,
    }
}

/// Select a model
///
/// Searches the kernel and the noise that explain values best, by their marginal likelihood, by leaving one out or by generalized cross-validation: from the
/// kernel of the request, or the one that is learned if there is none, and from further starts, by sequential quadratic programming with exact slopes within
/// bounds. Answers what was found, the criterion over alpha from one eigendecomposition, and each value predicted from all others. Every evaluation costs a
/// few factorizations, so clouds have 5,000 points at most: what a sample of more selects can be sent with all of them.
#[utoipa::path(
    post,
    path = "/v1/model-selection",
    operation_id = "select_model",
    tag = "values",
    request_body = ModelSelectionRequest,
    responses((status = 200, description = "What explains the values best", body = ModelSelectionResponse), ComputeProblems),
    security((), ("bearer" = []))
)]
pub async fn select_model(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    request: Request,
) -> Result<Response, Problem> {
    serve::<ModelSelectionRequest>(app, owner, request).await
}

/// α of a path.
const N_ALPHAS: usize = 61;

/// Points of a path at most: nothing looks whether anybody waits while its eigendecomposition is made, some seconds here.
const MAX_PATH_POINTS: usize = 3000;

/// Points of a selection at most: the same of its factorizations, and a hundred of these take minutes.
const MAX_POINTS: usize = 5000;

impl Operation for ModelSelectionRequest {
    const NAME: &'static str = "select_model";
    type Work = Work;
    type Answer = ModelSelectionResponse;
    const HAS_SURFACE: bool = false;

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<Work>, Problem> {
        let search = Search::of(&self)?;
        if self.duplicates == Some(DuplicatePolicy::Merge) {
            let detail = "what is left out are points of the cloud: merge those that coincide beforehand";
            return Err(Problem::invalid_request("/duplicates", detail));
        }
        let given = GivenValues::one(std::mem::take(&mut self.values));
        let fit = Fit { mean: self.mean, ..self.take_fit() };
        let dense_only = DenseOnly { name: "model selection", pointer: "/solver" };
        let (mut main, values) = planner.values_fit(fit, given, Some(dense_only))?;
        planner.queries(None, &mut main.on)?;
        let (n, d) = (main.on.n_points(), main.on.stored.cloud.dimension());
        if n > MAX_POINTS {
            let problem =
                Problem::too_large(Slug::ProblemTooLarge, "points of a selection", MAX_POINTS, Some(n));
            let remedy = "select on a sample of the points, and send what was found with all of them";
            return Err(problem.at(main.on.pointers.points).with_remedy(remedy));
        }
        search.check_axes_of(d)?;
        let n_numbers = planner.check_answer(n.checked_mul(3).and_then(|n| n.checked_add(4 * N_ALPHAS)))?;
        let cost = Cost { work: search.price((n, d), main.n_length_scales()), n_numbers, n_held: n };
        Ok(Plan { main: main.into(), surface: None, work: Work { values, search }, cost })
    }

    fn compute(work: Work, fits: &Fits, observer: &JobObserver) -> Result<ModelSelectionResponse, Problem> {
        work.run(fits, observer)
    }
}
