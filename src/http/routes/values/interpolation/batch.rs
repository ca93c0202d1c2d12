//! `POST /v1/interpolation/batch`: functions through many lists of values, with one factorization.

use super::{Work, arrays, checked_order, deviations_per_query, has_deviations, numbers_per_query};
use crate::http::fields::{Diagnostics, Fit, MeanChoice, ValueAttribute, request};
use crate::http::problem::Problem;
use crate::http::routes::operation::operation;
use crate::http::serve::answers::values::mean_coefficients;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::{Operation, Plan};
use crate::http::serve::plan::Cost;
use crate::http::serve::planner::{Planner, RestrictedQuantity, ValuesUse, value_lists};
use gramian_host::answer;
use gramian_host::compute::JobObserver;
use gramian_host::wire::read::points::{Points, ValueLists};
use gramian_host::wire::write::array::Array;
use gramian_numerics::error::SolverKind;
use gramian_numerics::machine::price::Sizes;
use gramian_numerics::model::EachAt;
use gramian_numerics::model::price::{function_price, lists_price};

request! {
    /// Many lists of values at the points of a cloud, and queries at which to evaluate the functions through
    /// them.
    pub struct InterpolationBatchRequest {
        /// Lists of values. Each has a value per point, in the order of the points.
        ///
        /// All lists have kernel and noise in common.
        #[schema(value_type = Vec<Vec<f64>>, min_items = 1)]
        pub values: ValueLists,
        /// The mean of each function. Default: a constant if `kernel` is absent too, else 0.
        pub mean: Option<MeanChoice>,
        /// The points to evaluate at, one row of coordinates each. Default: the points of the cloud.
        #[schema(value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
        pub queries: Option<Points>,
        /// The highest order of derivatives: 0 for values, 1 adds gradients, 2 adds Hessians. Default: 0.
        #[schema(minimum = 0, maximum = 2)]
        pub derivatives: Option<u8>,
        /// Optional parts of the answer. Default: none.
        pub include: Option<Vec<ValueAttribute>>,
    }
}

answer! {
    /// The interpolants (regression functions, if alpha > 0) at the queries. All have the same deviations.
    pub struct InterpolationBatchResponse {
        /// Values u at each query, a row per list.
        values: Array as Vec<Vec<f64>>,
        /// Gradients ∇u at each query for each list, unit of the values per length.
        ///
        /// Present if `derivatives` is 1 or 2.
        gradients: Option<Array> as Option<Vec<Vec<Vec<f64>>>>,
        /// Hessians D²u at each query for each list, unit of the values per length squared.
        ///
        /// Present if `derivatives` is 2.
        hessians: Option<Array> as Option<Vec<Vec<Vec<Vec<f64>>>>>,
        /// Standard deviation of each function at each query, given its values. Present if `include` has
        /// `std`.
        ///
        /// The kernel is taken as covariance, and alpha as variance of the noise. All lists have the same
        /// deviations.
        value_std: Option<Array> as Option<Vec<f64>>,
        /// Standard deviation of each component of ∇u at each query.
        ///
        /// Present if `include` has `std` and `derivatives` is 1 or 2.
        gradient_std: Option<Array> as Option<Vec<Vec<f64>>>,
        /// Standard deviation of each entry of D²u at each query.
        ///
        /// Present if `include` has `std` and `derivatives` is 2.
        hessian_std: Option<Array> as Option<Vec<Vec<Vec<f64>>>>,
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
/// Interpolate many lists of values
///
/// Interpolates each list as `/v1/interpolation` does, with one factorization for all lists. A kernel that is
/// not given is learned from all lists together. Batches need the dense solver.
pub async fn compute_interpolation_batch(InterpolationBatchRequest) -> InterpolationBatchResponse;
path: "/v1/interpolation/batch", tag: "values", answer: "The functions at the queries"
}

impl Operation for InterpolationBatchRequest {
    type Work = Work;

    fn values_use(&self) -> ValuesUse {
        ValuesUse::Alone
    }

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<Work>, Problem> {
        let derivatives = checked_order(self.derivatives)?;
        let given = value_lists(std::mem::take(&mut self.values))?;
        let fit = Fit { mean: self.mean, ..self.take_fit() };
        let has_deviations = has_deviations(self.include);
        let of_batch =
            RestrictedQuantity { name: "batches", pointer: "/solver", without: &[SolverKind::Local] };
        let (mut main, values) = planner.values_fit(fit, given, Some(of_batch))?;
        let queries = planner.queries(self.queries, &mut main.on)?;
        let (n, m, d) = (main.on.n_points(), queries.n_points(), queries.dimension());
        let (per_query, k) = (numbers_per_query(d, derivatives), values.n_lists);
        let n_deviations = if has_deviations { deviations_per_query(d, derivatives) } else { 0 };
        let sizes = Sizes { n_points: n, n_queries: m, dimension: d };
        let work = function_price(main.solver, usize::from(derivatives), n_deviations, sizes)
            .and(lists_price(main.solver, k, per_query - 1, sizes));
        let of_means = k.checked_mul(1 + d);
        let n_numbers = k
            .checked_add(usize::from(has_deviations))
            .and_then(|lists| lists.checked_mul(m)?.checked_mul(per_query)?.checked_add(of_means?));
        let cost =
            Cost { work, n_numbers: planner.check_answer(n_numbers)?, n_held: values.list.len() + m * d };
        let work = Work { values, queries, derivatives, has_deviations };
        Ok(Plan::of_values(main, work, cost))
    }

    fn compute(
        work: Work,
        fits: &Fits,
        observer: &JobObserver,
    ) -> Result<InterpolationBatchResponse, Problem> {
        let (found, mut diagnostics) = fits.each_at(&work.values, work.asked(), observer)?;
        let mean_coefficients = mean_coefficients(&found.batch);
        let EachAt { jets, deviations, batch, .. } = found;
        let clamped = deviations.as_ref().map_or(&[][..], |deviations| &deviations.clamped);
        diagnostics.warn_of_clamping(clamped);
        let Work { queries, derivatives, .. } = work;
        let (k, m, d) = (batch.solutions.len(), queries.n_points(), queries.dimension());
        let [value_std, gradient_std, hessian_std] = arrays(deviations, &queries, derivatives);
        Ok(InterpolationBatchResponse {
            values: Array::new(jets.values, &[k, m]),
            gradients: (derivatives >= 1).then(|| Array::new(jets.gradients, &[k, m, d])),
            hessians: (derivatives >= 2).then(|| Array::new(jets.hessians, &[k, m, d, d])),
            value_std,
            gradient_std,
            hessian_std,
            mean_coefficients,
            diagnostics,
        })
    }
}
