//! `POST /v1/interpolation`.

use std::sync::Arc;

use axum::Extension;
use axum::extract::{Request, State};
use axum::response::Response;

use crate::http::compute::JobObserver;
use crate::http::fields::{Diagnostics, request};
use crate::http::openapi::responses::ComputeProblems;
use crate::http::problem::Problem;
use crate::http::serve::app::App;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::{Operation, Plan, serve};
use crate::http::serve::plan::Cost;
use crate::http::serve::planner::Planner;
use crate::http::serve::values::{ValuesAt, ValuesRequest};
use crate::http::wire::read::members::present;
use crate::http::wire::read::points::Points;
use crate::http::wire::write::answer::answer;
use crate::http::wire::write::array::Array;
use crate::numerics::points::cloud::Cloud;
use crate::numerics::solver::choose::{Asked, work_price};
use crate::numerics::sums::jets::JetOrder;
use crate::store::Owner;

request! {
    /// Values at the points of a cloud, and where the function through them is wanted.
    pub struct InterpolationRequest {
        /// The values at the points, in their order.
        #[schema(min_items = 1)]
        pub values: Vec<f64>,
        /// Where answers are wanted; the points of the cloud if absent.
        #[serde(default, deserialize_with = "present")]
        #[schema(nullable = false, value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
        pub queries: Option<Points>,
        /// 0 for values, 1 for gradients as well, 2 for Hessians as well; 0 if absent.
        #[serde(default, deserialize_with = "present")]
        #[schema(nullable = false, minimum = 0, maximum = 2)]
        pub derivatives: Option<u8>,
    }
}

answer! {
    /// The interpolant (regression function, if alpha > 0) at the queries.
    pub struct InterpolationResponse {
        /// u at each query.
        #[schema(value_type = Vec<f64>)]
        values: Array,
        /// ∇u at each query, unit of the values per length; with `derivatives` of 1 or 2.
        #[schema(nullable = false, value_type = Option<Vec<Vec<f64>>>)]
        gradients: Option<Array>,
        /// D²u at each query, unit of the values per length squared; with `derivatives` of 2.
        #[schema(nullable = false, value_type = Option<Vec<Vec<Vec<f64>>>>)]
        hessians: Option<Array>,
        /// How the answer came about.
        diagnostics: Diagnostics,
    }
}

/// Interpolate values
///
/// Fits `u = Σ λ_j k(·, x_j)` to the values, Λ = (K + αI)⁻¹Y, and evaluates it with its derivatives at the queries. At
/// alpha = 0 it takes the values at the points exactly. With `"solver": "local"`, and beyond the points that are factorized, each query is
/// answered from the points nearest to it.
#[utoipa::path(
    post,
    path = "/v1/interpolation",
    operation_id = "compute_interpolation",
    tag = "values",
    request_body = InterpolationRequest,
    responses((status = 200, description = "The function at the queries", body = InterpolationResponse), ComputeProblems),
    security((), ("bearer" = []))
)]
pub async fn compute_interpolation(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    request: Request,
) -> Result<Response, Problem> {
    serve::<InterpolationRequest>(app, owner, request).await
}

/// A checked request.
pub struct Work {
    values: Vec<f64>,
    queries: Arc<Cloud>,
    derivatives: u8,
}

impl Operation for InterpolationRequest {
    type Work = Work;
    type Answer = InterpolationResponse;
    const HAS_SURFACE: bool = false;

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<Work>, Problem> {
        let derivatives = self.derivatives.unwrap_or(0);
        if derivatives > 2 {
            return Err(Problem::invalid_request("/derivatives", "derivatives must be 0, 1 or 2"));
        }
        let mut main = planner.values_fit(self.take_fit(), None)?;
        planner.check_values(&self.values, &main)?;
        let queries = planner.queries(self.queries, &mut [&mut main])?;
        let (n, m, d) = (main.n_points(), queries.n_points(), queries.dimension());
        let per_query = [1, 1 + d, 1 + d + d * d][usize::from(derivatives)];
        let asked = if main.is_moving() { Asked::Moving } else { Asked::Function };
        let cost = Cost {
            work: work_price(asked, n, m, d),
            n_numbers: planner.check_answer(m.checked_mul(per_query))?,
            n_held: n + m * d,
        };
        Ok(Plan { main, surface: None, work: Work { values: self.values, queries, derivatives }, cost })
    }

    fn compute(work: Work, fits: &Fits, observer: &JobObserver) -> Result<InterpolationResponse, Problem> {
        let order = [JetOrder::Value, JetOrder::Gradient, JetOrder::Hessian][usize::from(work.derivatives)];
        let asked =
            ValuesRequest { values: &work.values, queries: &work.queries, order, has_variances: false };
        let ValuesAt { jets, diagnostics, .. } = fits.values_at(asked, observer)?;
        let (m, d) = (jets.n_queries(), jets.dimension());
        Ok(InterpolationResponse {
            values: Array::new(jets.values(), &[m]),
            gradients: (work.derivatives >= 1).then(|| Array::new(jets.gradients(), &[m, d])),
            hessians: (work.derivatives >= 2).then(|| Array::new(jets.hessians(), &[m, d, d])),
            diagnostics,
        })
    }
}
