//! `POST /v1/laplace-beltrami`: the operator on values, as a dense matrix (`/matrix`) and as a sparse one
//! (`/sparse-matrix`).

use super::operator::{
    AppliedAnswer, AppliedWork, MatrixAnswer, MatrixWork, OperatorParts, SparseAnswer, StencilWork,
};
use crate::http::fields::{Diagnostics, Fit, Flag, MeanChoice, Surface, ValueAttribute, request};
use crate::http::problem::Problem;
use crate::http::routes::operation::operation;
use crate::http::serve::fitted::Fits;
use crate::http::serve::operation::{Operation, Plan};
use crate::http::serve::planner::{Planner, ValuesUse};
use gramian_host::answer;
use gramian_host::compute::JobObserver;
use gramian_host::wire::negotiation::Format;
use gramian_host::wire::read::points::Points;
use gramian_host::wire::write::array::Array;
use gramian_host::wire::write::integers::Integers;
use gramian_numerics::operators::Operator;

const OPERATOR: Operator = Operator::LaplaceBeltrami;

request! {
    /// Values on a surface, and queries at which to compute their Laplace–Beltrami operator.
    pub struct LaplaceBeltramiRequest with surface taking hyperparameters {
        /// The values at the points of `cloud`, in their order.
        #[schema(min_items = 1)]
        pub values: Vec<f64>,
        /// The mean of the function. Default: a constant if `kernel` is absent too, else 0.
        pub mean: Option<MeanChoice>,
        /// The points to compute at, one row of coordinates each. Default: the points of the surface's cloud.
        #[schema(value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
        pub queries: Option<Points>,
        /// The surface, if its fit differs from that of the values.
        pub surface: Option<Surface>,
        /// Optional parts of the answer. Default: none.
        pub include: Option<Vec<ValueAttribute>>,
    }
}

request! {
    /// A cloud of nodes on a surface, and queries for the rows of its Laplace–Beltrami matrix.
    pub struct LaplaceBeltramiMatrixRequest with surface taking hyperparameters {
        /// The points to compute rows for, one row of the matrix each. Default: the points of the surface's
        /// cloud.
        #[schema(value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
        pub queries: Option<Points>,
        /// The surface, if its fit differs from that of the values.
        pub surface: Option<Surface>,
        /// The mean of the functions through the values. Default: 0.
        ///
        /// With a constant mean, the matrix maps constants to exactly 0.
        pub mean: Option<MeanChoice>,
    }
}

answer! {
    /// The Laplace–Beltrami operator of the values at the queries.
    pub struct LaplaceBeltramiResponse {
        /// Δu at each query, unit of the values per length squared. Null where there is no normal.
        laplacians: Array as Vec<Option<f64>>,
        /// Standard deviation of Δu at each query. Present if `include` has `std`.
        ///
        /// It comes from noise and gaps of the values and, as far as the surface has deviations, also from
        /// the surface. Null where there is no answer or no deviation.
        laplacian_std: Option<Array> as Option<Vec<Option<f64>>>,
        /// The queries where geometry has no meaning (null), or less accuracy than it seems.
        flags: Vec<Flag>,
        /// The numbers used, the method, its accuracy, and warnings.
        diagnostics: Diagnostics,
    }
}

answer! {
    /// The Laplace–Beltrami operator as a matrix.
    pub struct LaplaceBeltramiMatrixResponse {
        /// The matrix, unit 1/length². Rows are queries, and columns are the points of `cloud`.
        ///
        /// A row is null where there is no normal. The matrix is not symmetric in general.
        matrix: Array as Vec<Option<Vec<f64>>>,
        /// The queries where geometry has no meaning (null), or less accuracy than it seems.
        flags: Vec<Flag>,
        /// The numbers used, the method, its accuracy, and warnings.
        diagnostics: Diagnostics,
    }
}

operation! {
/// Compute the Laplace–Beltrami operator
///
/// Returns Δu = tr D²u − νᵀD²uν − tr(Dν) ∂_νu of the function u through the values, on the level surface of
/// the signature function. On the unit circle Δ cos θ = −cos θ.
pub async fn compute_laplace_beltrami(LaplaceBeltramiRequest) -> LaplaceBeltramiResponse;
path: "/v1/laplace-beltrami", tag: "operators", answer: "Δu at the queries"
}

operation! {
/// Assemble the Laplace–Beltrami matrix
///
/// Returns the matrix that maps values at the nodes to the Laplace–Beltrami operator at the queries. The
/// matrix need not be square.
pub async fn assemble_laplace_beltrami_matrix(LaplaceBeltramiMatrixRequest) -> LaplaceBeltramiMatrixResponse;
path: "/v1/laplace-beltrami/matrix", tag: "operators", answer: "The matrix"
}

impl Operation for LaplaceBeltramiRequest {
    type Work = AppliedWork;

    fn values_use(&self) -> ValuesUse {
        ValuesUse::OnSurface
    }

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<AppliedWork>, Problem> {
        let values = std::mem::take(&mut self.values);
        let fit = Fit { mean: self.mean, ..self.take_fit() };
        let applied =
            OperatorParts { surface: self.surface, values, queries: self.queries, include: self.include };
        AppliedWork::plan(planner, OPERATOR, fit, applied)
    }

    fn compute(
        work: AppliedWork,
        fits: &Fits,
        observer: &JobObserver,
    ) -> Result<LaplaceBeltramiResponse, Problem> {
        let AppliedAnswer { values, deviations, flags, diagnostics } =
            work.apply(OPERATOR, fits, observer)?;
        Ok(LaplaceBeltramiResponse { laplacians: values, laplacian_std: deviations, flags, diagnostics })
    }
}

impl Operation for LaplaceBeltramiMatrixRequest {
    type Work = MatrixWork;
    const FORMATS: &[Format] = &[Format::Json, Format::Safetensors, Format::Npy];

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<MatrixWork>, Problem> {
        let fit = Fit { mean: self.mean, ..self.take_fit() };
        MatrixWork::plan(planner, OPERATOR, fit, self.surface, self.queries)
    }

    fn compute(
        work: MatrixWork,
        fits: &Fits,
        observer: &JobObserver,
    ) -> Result<LaplaceBeltramiMatrixResponse, Problem> {
        let MatrixAnswer { matrix, flags, diagnostics } = work.matrix(OPERATOR, fits, observer)?;
        Ok(LaplaceBeltramiMatrixResponse { matrix, flags, diagnostics })
    }
}

request! {
    /// A cloud of nodes on a surface, and queries for the rows of its sparse Laplace–Beltrami matrix.
    pub struct LaplaceBeltramiSparseMatrixRequest with surface taking hyperparameters {
        /// The points to compute rows for, one row of the matrix each. Default: the points of the surface.
        #[schema(value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
        pub queries: Option<Points>,
        /// The surface, if it differs from that of the request.
        pub surface: Option<Surface>,
    }
}

answer! {
    /// The Laplace–Beltrami operator as a sparse matrix with rows for the queries and columns for the nodes.
    pub struct LaplaceBeltramiSparseMatrixResponse {
        /// The number of queries and the number of nodes.
        shape: Integers as Vec<i64>,
        /// The position of the first entry of each row, from 0, and the number of all entries at the end.
        indptr: Integers as Vec<i64>,
        /// The column of each entry, from 0, ascending within a row.
        indices: Integers as Vec<i64>,
        /// The entries row by row, 1/length².
        ///
        /// In Python: `scipy.sparse.csr_matrix((data, indices, indptr), shape)`.
        data: Array as Vec<f64>,
        /// The queries where geometry has no meaning (an empty row), or less accuracy than it seems.
        flags: Vec<Flag>,
        /// The numbers used for the surface, the method, its accuracy, and warnings.
        diagnostics: Diagnostics,
    }
}

operation! {
/// Assemble the sparse matrix of the Laplace–Beltrami operator
///
/// Returns a matrix whose rows weight the nodes near each query. Weights come from smoothed polyharmonic
/// splines with polynomials of degree 4 over the tangent plane. They are exact for these polynomials, and of
/// third order for second derivatives. The matrix needs no kernel for values and takes any number of nodes.
///
/// If the queries are the nodes, no eigenvalue has a positive real part, so the matrix can be used for time
/// steps. To achieve this, rows at a rim are those of a no-flux (homogeneous Neumann) boundary, and are
/// flagged.
/// `diagnostics.stencils` counts rows of each kind.
pub async fn assemble_laplace_beltrami_sparse_matrix(LaplaceBeltramiSparseMatrixRequest) -> LaplaceBeltramiSparseMatrixResponse;
path: "/v1/laplace-beltrami/sparse-matrix", tag: "operators", answer: "The matrix"
}

impl Operation for LaplaceBeltramiSparseMatrixRequest {
    type Work = StencilWork;

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<StencilWork>, Problem> {
        let fit = self.take_fit();
        StencilWork::plan(planner, OPERATOR, fit, self.surface, self.queries)
    }

    fn compute(
        work: StencilWork,
        fits: &Fits,
        observer: &JobObserver,
    ) -> Result<LaplaceBeltramiSparseMatrixResponse, Problem> {
        let SparseAnswer { shape, indptr, indices, data, flags, diagnostics } =
            work.matrix(OPERATOR, fits, observer)?;
        Ok(LaplaceBeltramiSparseMatrixResponse { shape, indptr, indices, data, flags, diagnostics })
    }
}
