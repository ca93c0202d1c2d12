//! `POST /v1/interpolation`: the function through values at the points of a cloud.

mod batch;

use std::sync::Arc;

use crate::http::fields::{Diagnostics, Fit, MeanChoice, ValueAttribute, request};
use crate::http::problem::Problem;
use crate::http::routes::operation::operation;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::{Operation, Plan};
use crate::http::serve::plan::{Cost, Values};
use crate::http::serve::planner::{GivenValues, Planner, ValuesUse};
pub use batch::*;
use gramian_host::answer;
use gramian_host::compute::JobObserver;
use gramian_host::wire::read::points::Points;
use gramian_host::wire::write::array::Array;
use gramian_numerics::machine::price::Sizes;
use gramian_numerics::model::price::function_price;
use gramian_numerics::model::{JetRequest, ValuesAt};
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::function::deviations::JetDeviations;
use gramian_numerics::regression::sums::jets::JetOrder;

request! {
    /// Values at the points of a cloud, and queries at which to evaluate the function through them.
    pub struct InterpolationRequest {
        /// The values at the points, in their order.
        #[schema(min_items = 1)]
        pub values: Vec<f64>,
        /// The mean of the function. Default: a constant if `kernel` is absent too, else 0.
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
    /// The interpolant (regression function, if alpha > 0) at the queries.
    pub struct InterpolationResponse {
        /// u at each query.
        values: Array as Vec<f64>,
        /// ∇u at each query, unit of the values per length. Present if `derivatives` is 1 or 2.
        gradients: Option<Array> as Option<Vec<Vec<f64>>>,
        /// D²u at each query, unit of the values per length squared. Present if `derivatives` is 2.
        hessians: Option<Array> as Option<Vec<Vec<Vec<f64>>>>,
        /// Standard deviation of u at each query, given the values. Present if `include` has `std`.
        ///
        /// The kernel is taken as covariance, and alpha as variance of the noise.
        value_std: Option<Array> as Option<Vec<f64>>,
        /// Standard deviation of each component of ∇u at each query.
        ///
        /// Present if `include` has `std` and `derivatives` is 1 or 2.
        gradient_std: Option<Array> as Option<Vec<Vec<f64>>>,
        /// Standard deviation of each entry of D²u at each query.
        ///
        /// Present if `include` has `std` and `derivatives` is 2.
        hessian_std: Option<Array> as Option<Vec<Vec<Vec<f64>>>>,
        /// The numbers used, the method, its accuracy, and warnings.
        diagnostics: Diagnostics,
    }
}

operation! {
/// Interpolate values
///
/// Fits `u = Σ λ_j k(·, x_j)` to the values, Λ = (K + αI)⁻¹Y, and evaluates u with its derivatives at the
/// queries. If alpha = 0, u takes the values at the points exactly. With `"solver": "local"`, and for clouds
/// that are too large to be factorized, each query is answered from the points nearest to it.
pub async fn compute_interpolation(InterpolationRequest) -> InterpolationResponse;
path: "/v1/interpolation", tag: "values", answer: "The function at the queries"
}

/// A checked request for one list of values or many.
pub struct Work {
    values: Arc<Values>,
    queries: Arc<Cloud>,
    derivatives: u8,
    has_deviations: bool,
}

impl Work {
    fn asked(&self) -> JetRequest<'_> {
        JetRequest {
            queries: &self.queries,
            order: order_of(self.derivatives),
            has_variances: false,
            deviations: self.has_deviations.then_some(order_of(self.derivatives)),
        }
    }
}

impl Operation for InterpolationRequest {
    type Work = Work;

    fn values_use(&self) -> ValuesUse {
        ValuesUse::Alone
    }

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<Work>, Problem> {
        let derivatives = checked_order(self.derivatives)?;
        let given = GivenValues::one(std::mem::take(&mut self.values));
        let fit = Fit { mean: self.mean, ..self.take_fit() };
        let has_deviations = has_deviations(self.include);
        let (mut main, values) = planner.values_fit(fit, given, None)?;
        let queries = planner.queries(self.queries, &mut main.on)?;
        let (n, m, d) = (main.on.n_points(), queries.n_points(), queries.dimension());
        let sizes = Sizes { n_points: n, n_queries: m, dimension: d };
        let n_deviations = if has_deviations { deviations_per_query(d, derivatives) } else { 0 };
        let n_lists = if has_deviations { 2 } else { 1 };
        let cost = Cost {
            work: function_price(main.solver, usize::from(derivatives), n_deviations, sizes),
            n_numbers: planner.check_answer(m.checked_mul(n_lists * numbers_per_query(d, derivatives)))?,
            n_held: n + m * d,
        };
        let work = Work { values, queries, derivatives, has_deviations };
        Ok(Plan::of_values(main, work, cost))
    }

    fn compute(work: Work, fits: &Fits, observer: &JobObserver) -> Result<InterpolationResponse, Problem> {
        let (found, mut diagnostics) = fits.values_at(&work.values, work.asked(), observer)?;
        let ValuesAt { jets, deviations, .. } = found;
        let clamped = deviations.as_ref().map_or(&[][..], |deviations| &deviations.clamped);
        diagnostics.warn_of_clamping(clamped);
        let (m, d) = (jets.n_queries(), jets.dimension());
        let [of_values, of_gradients, of_hessians] = arrays(deviations, &work.queries, work.derivatives);
        Ok(InterpolationResponse {
            values: Array::new(jets.values(), &[m]),
            gradients: (work.derivatives >= 1).then(|| Array::new(jets.gradients(), &[m, d])),
            hessians: (work.derivatives >= 2).then(|| Array::new(jets.hessians(), &[m, d, d])),
            value_std: of_values,
            gradient_std: of_gradients,
            hessian_std: of_hessians,
            diagnostics,
        })
    }
}

fn checked_order(derivatives: Option<u8>) -> Result<u8, Problem> {
    match derivatives.unwrap_or(0) {
        order @ 0..=2 => Ok(order),
        _ => Err(Problem::invalid_request("/derivatives", "derivatives must be 0, 1 or 2")),
    }
}

fn order_of(derivatives: u8) -> JetOrder {
    [JetOrder::Value, JetOrder::Gradient, JetOrder::Hessian][usize::from(derivatives)]
}

fn has_deviations(include: Option<Vec<ValueAttribute>>) -> bool {
    include.is_some_and(|include| include.contains(&ValueAttribute::Std))
}

/// Returns how many numbers a query has: value, gradient and Hessian, up to the order of `derivatives`.
fn numbers_per_query(d: usize, derivatives: u8) -> usize {
    [1, 1 + d, 1 + d + d * d][usize::from(derivatives)]
}

/// Returns how many deviations a query needs. Equal entries of a Hessian are counted once.
fn deviations_per_query(d: usize, derivatives: u8) -> usize {
    [1, 1 + d, 1 + d + d * (d + 1) / 2][usize::from(derivatives)]
}

/// Returns the deviations of values, gradients and Hessians as arrays, up to the order of `derivatives`.
fn arrays(deviations: Option<JetDeviations>, queries: &Cloud, derivatives: u8) -> [Option<Array>; 3] {
    let (m, d) = (queries.n_points(), queries.dimension());
    let Some(JetDeviations { values, gradients, hessians, .. }) = deviations else {
        return [None, None, None];
    };
    [
        Some(Array::new(values, &[m])),
        (derivatives >= 1).then(|| Array::new(gradients, &[m, d])),
        (derivatives >= 2).then(|| Array::new(hessians, &[m, d, d])),
    ]
}
