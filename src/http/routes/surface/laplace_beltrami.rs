//! `POST /v1/laplace-beltrami` and `POST /v1/laplace-beltrami/matrix`.

use std::sync::Arc;

use axum::Extension;
use axum::extract::{Request, State};
use axum::response::Response;
use serde::Deserialize;
use utoipa::ToSchema;

use super::operator::{Applied, AppliedWork, MatrixWork, StencilWork};
use crate::http::compute::JobObserver;
use crate::http::fields::{
    CloudRef, Degenerate, Diagnostics, Fit, Geometry, MeanChoice, ValuesInclude, request,
};
use crate::http::openapi::responses::ComputeProblems;
use crate::http::problem::Problem;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::{Operation, Plan, serve};
use crate::http::serve::planner::Planner;
use crate::http::state::app::App;
use crate::http::wire::negotiation::Format;
use crate::http::wire::read::members::{
    present, present_object, present_unless_empty, present_word, present_words,
};
use crate::http::wire::read::points::Points;
use crate::http::wire::write::answer::answer;
use crate::http::wire::write::array::Array;
use crate::http::wire::write::integers::Integers;
use crate::store::Owner;
use gramian_numerics::surface::operators::Operator;

const OPERATOR: Operator = Operator::LaplaceBeltrami;

request! {
    /// Values on a surface, and where their Laplace–Beltrami operator is wanted.
    pub struct LaplaceBeltramiRequest {
        /// The values at the points of `cloud`, in their order.
        #[schema(min_items = 1)]
        pub values: Vec<f64>,
        /// The mean of the function; a constant if absent with the kernel, else 0.
        #[serde(default, deserialize_with = "present_word")]
        #[schema(nullable = false)]
        pub mean: Option<MeanChoice>,
        /// Where answers are wanted; the points of the surface's cloud if absent.
        #[serde(default, deserialize_with = "present")]
        #[schema(nullable = false, value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
        pub queries: Option<Points>,
        /// The surface, where its fit differs from that of the values.
        #[serde(default, deserialize_with = "present_object")]
        #[schema(nullable = false)]
        pub geometry: Option<Geometry>,
        /// What is wanted beside; nothing if absent.
        #[serde(default, deserialize_with = "present_words")]
        #[schema(nullable = false)]
        pub include: Option<Vec<ValuesInclude>>,
    }
}

/// How a matrix is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MatrixFormat {
    /// Every entry, row by row.
    #[default]
    Dense,
}

request! {
    /// A cloud of nodes on a surface, and where rows of its Laplace–Beltrami matrix are wanted.
    pub struct LaplaceBeltramiMatrixRequest {
        /// Where answers are wanted, one row each; the points of the surface's cloud if absent.
        #[serde(default, deserialize_with = "present")]
        #[schema(nullable = false, value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
        pub queries: Option<Points>,
        /// The surface, where its fit differs from that of the values.
        #[serde(default, deserialize_with = "present_object")]
        #[schema(nullable = false)]
        pub geometry: Option<Geometry>,
        /// The mean of the functions through the values; 0 if absent. With a constant the matrix makes constants exactly 0.
        #[serde(default, deserialize_with = "present_word")]
        #[schema(nullable = false)]
        pub mean: Option<MeanChoice>,
        /// Retired: a matrix of this path is dense. Sparse ones are answered by `/v1/laplace-beltrami/sparse-matrix`.
        #[serde(default, deserialize_with = "present_word")]
        #[schema(nullable = false, deprecated)]
        pub format: Option<MatrixFormat>,
    }
}

answer! {
    /// The Laplace–Beltrami operator of the values at the queries.
    pub struct LaplaceBeltramiResponse {
        /// Δu at each query, unit of the values per length squared; null where there is no normal.
        #[schema(value_type = Vec<Option<f64>>)]
        values: Array,
        /// Standard deviation of Δu given the values and, as far as its deviations are known, the surface; null where there is no
        /// answer or no deviation; with `deviations`.
        #[schema(nullable = false, value_type = Option<Vec<Option<f64>>>)]
        value_deviations: Option<Array>,
        /// The queries where geometry has no meaning (null), or less accuracy than it seems.
        degenerate: Vec<Degenerate>,
        /// How the answer came about.
        diagnostics: Diagnostics,
    }
}

answer! {
    /// The Laplace–Beltrami operator as a matrix.
    pub struct LaplaceBeltramiMatrixResponse {
        /// Rows are queries, columns are the points of `cloud`, 1/length²; a row is null where there is no normal. Not symmetric
        /// in general.
        #[schema(value_type = Vec<Option<Vec<f64>>>)]
        matrix: Array,
        /// The queries where geometry has no meaning (null), or less accuracy than it seems.
        degenerate: Vec<Degenerate>,
        /// How the answer came about.
        diagnostics: Diagnostics,
    }
}

/// Compute the Laplace–Beltrami operator
///
/// Δu = tr D²u − νᵀD²uν − tr(Dν) ∂_νu of the function through the values, on the level surface of the signature function. On
/// the unit circle Δ cos θ = −cos θ.
#[utoipa::path(
    post,
    path = "/v1/laplace-beltrami",
    operation_id = "compute_laplace_beltrami",
    tag = "operators",
    request_body = LaplaceBeltramiRequest,
    responses((status = 200, description = "Δu at the queries", body = LaplaceBeltramiResponse), ComputeProblems),
    security((), ("bearer" = []))
)]
pub async fn compute_laplace_beltrami(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    request: Request,
) -> Result<Response, Problem> {
    serve::<LaplaceBeltramiRequest>(app, owner, request).await
}

/// Assemble the Laplace–Beltrami matrix
///
/// The matrix that turns values at the nodes into the Laplace–Beltrami operator at the queries: square, or not.
#[utoipa::path(
    post,
    path = "/v1/laplace-beltrami/matrix",
    operation_id = "assemble_laplace_beltrami_matrix",
    tag = "operators",
    request_body = LaplaceBeltramiMatrixRequest,
    responses((status = 200, description = "The matrix", body = LaplaceBeltramiMatrixResponse), ComputeProblems),
    security((), ("bearer" = []))
)]
pub async fn assemble_laplace_beltrami_matrix(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    request: Request,
) -> Result<Response, Problem> {
    serve::<LaplaceBeltramiMatrixRequest>(app, owner, request).await
}

impl Operation for LaplaceBeltramiRequest {
    const NAME: &'static str = "compute_laplace_beltrami";
    type Work = AppliedWork;
    type Answer = LaplaceBeltramiResponse;
    const HAS_SURFACE: bool = true;

    fn surface_cloud(&self) -> Option<&CloudRef> {
        self.geometry.as_ref()?.cloud.as_ref()
    }

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<AppliedWork>, Problem> {
        let values = std::mem::take(&mut self.values);
        let fit = Fit { mean: self.mean, ..self.take_fit() };
        let applied =
            Applied { geometry: self.geometry, values, queries: self.queries, include: self.include };
        AppliedWork::plan(planner, OPERATOR, fit, applied)
    }

    fn compute(
        work: AppliedWork,
        fits: &Fits,
        observer: &JobObserver,
    ) -> Result<LaplaceBeltramiResponse, Problem> {
        let found = work.apply(OPERATOR, fits, observer)?;
        Ok(LaplaceBeltramiResponse {
            values: found.values,
            value_deviations: found.deviations,
            degenerate: found.degenerate,
            diagnostics: found.diagnostics,
        })
    }
}

impl Operation for LaplaceBeltramiMatrixRequest {
    const NAME: &'static str = "assemble_laplace_beltrami_matrix";
    type Work = MatrixWork;
    type Answer = LaplaceBeltramiMatrixResponse;
    const HAS_SURFACE: bool = true;

    fn surface_cloud(&self) -> Option<&CloudRef> {
        self.geometry.as_ref()?.cloud.as_ref()
    }
    const FORMATS: &[Format] = &[Format::Json, Format::Safetensors, Format::Npy];

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<MatrixWork>, Problem> {
        let MatrixFormat::Dense = self.format.unwrap_or_default();
        let fit = Fit { mean: self.mean, ..self.take_fit() };
        MatrixWork::plan(planner, OPERATOR, fit, self.geometry, self.queries)
    }

    fn compute(
        work: MatrixWork,
        fits: &Fits,
        observer: &JobObserver,
    ) -> Result<LaplaceBeltramiMatrixResponse, Problem> {
        let found = work.matrix(OPERATOR, fits, observer)?;
        Ok(LaplaceBeltramiMatrixResponse {
            matrix: found.matrix,
            degenerate: found.degenerate,
            diagnostics: found.diagnostics,
        })
    }
}

request! {
    /// Nodes and queries of the operator as a sparse matrix.
    pub struct LaplaceBeltramiSparseMatrixRequest {
        /// Where rows are wanted; the points of the surface if absent.
        #[serde(default, deserialize_with = "present")]
        #[schema(nullable = false, value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
        pub queries: Option<Points>,
        /// The surface, where it is not that of the request.
        #[serde(default, deserialize_with = "present_object")]
        #[schema(nullable = false)]
        pub geometry: Option<Geometry>,
        /// Where `"solver": "local"` learns noise and shape of the surface, at most 192 points of the cloud; 96 to
        /// 191 that it chooses if absent. Parts of one cloud with the same sites, and the points around them,
        /// learn the same.
        #[serde(default, deserialize_with = "present_unless_empty")]
        #[schema(nullable = false, value_type = Option<Vec<Vec<f64>>>, max_items = 192)]
        pub sites: Option<Points>,
    }
}

answer! {
    /// The Laplace–Beltrami operator as a sparse matrix with rows for the queries and columns for the nodes.
    pub struct LaplaceBeltramiSparseMatrixResponse {
        /// Queries, nodes.
        #[schema(value_type = Vec<i64>)]
        shape: Integers,
        /// Where each row begins among the entries, and how many there are, from 0.
        #[schema(value_type = Vec<i64>)]
        indptr: Integers,
        /// The column of each entry, from 0, ascending within a row.
        #[schema(value_type = Vec<i64>)]
        indices: Integers,
        /// The entries row by row, 1/length²: `scipy.sparse.csr_matrix((data, indices, indptr), shape)`.
        #[schema(value_type = Vec<f64>)]
        data: Array,
        /// The queries where geometry has no meaning (an empty row), or less accuracy than it seems.
        degenerate: Vec<Degenerate>,
        /// How the surface came about.
        diagnostics: Diagnostics,
    }
}

/// Assemble the sparse matrix of the Laplace–Beltrami operator
///
/// Weights of the nodes near each query, by smoothed polyharmonic splines with polynomials of degree 4 over the tangent plane: exact
/// for these, of third order for second derivatives. It needs no kernel for values and takes any number of nodes. Over the nodes
/// themselves no eigenvalue has a positive real part, so that it can be stepped in time. For that, rows at a rim are those of a
/// boundary that nothing flows through, and are flagged; `diagnostics.stencils` counts rows of each kind.
#[utoipa::path(
    post,
    path = "/v1/laplace-beltrami/sparse-matrix",
    operation_id = "assemble_laplace_beltrami_sparse_matrix",
    tag = "operators",
    request_body = LaplaceBeltramiSparseMatrixRequest,
    responses((status = 200, description = "The matrix", body = LaplaceBeltramiSparseMatrixResponse), ComputeProblems),
    security((), ("bearer" = []))
)]
pub async fn assemble_laplace_beltrami_sparse_matrix(
    State(app): State<Arc<App>>,
    Extension(owner): Extension<Owner>,
    request: Request,
) -> Result<Response, Problem> {
    serve::<LaplaceBeltramiSparseMatrixRequest>(app, owner, request).await
}

impl Operation for LaplaceBeltramiSparseMatrixRequest {
    const NAME: &'static str = "assemble_laplace_beltrami_sparse_matrix";
    type Work = StencilWork;
    type Answer = LaplaceBeltramiSparseMatrixResponse;
    const HAS_SURFACE: bool = true;

    fn surface_cloud(&self) -> Option<&CloudRef> {
        self.geometry.as_ref()?.cloud.as_ref()
    }

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<StencilWork>, Problem> {
        let fit = Fit { sites: self.sites.take(), ..self.take_fit() };
        StencilWork::plan(planner, OPERATOR, fit, self.geometry, self.queries)
    }

    fn compute(
        work: StencilWork,
        fits: &Fits,
        observer: &JobObserver,
    ) -> Result<LaplaceBeltramiSparseMatrixResponse, Problem> {
        let found = work.matrix(OPERATOR, fits, observer)?;
        Ok(LaplaceBeltramiSparseMatrixResponse {
            shape: found.shape,
            indptr: found.indptr,
            indices: found.indices,
            data: found.data,
            degenerate: found.degenerate,
            diagnostics: found.diagnostics,
        })
    }
}
