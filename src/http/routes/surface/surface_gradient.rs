//! `POST /v1/surface-gradient`: the operator on values, as dense matrices (`/matrix`) and as sparse ones
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

const OPERATOR: Operator = Operator::SurfaceGradient;

request! {
    /// Values on a surface, and queries at which to compute their surface gradient.
    pub struct SurfaceGradientRequest with surface taking hyperparameters {
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
    /// A cloud of nodes on a surface, and queries for the rows of its surface gradient matrices.
    pub struct SurfaceGradientMatrixRequest with surface taking hyperparameters {
        /// The points to compute rows for, one row of each matrix. Default: the points of the surface's
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
    /// Surface gradients at the queries.
    pub struct SurfaceGradientResponse {
        /// ∇u − (∇u·ν)ν at each query, unit of the values per length. Null where there is no normal.
        gradients: Array as Vec<Option<Vec<f64>>>,
        /// Standard deviation of each component at each query. Present if `include` has `std`.
        ///
        /// It comes from noise and gaps of the values and, as far as the surface has deviations, also from
        /// the surface. Null where there is no answer or no deviation.
        gradient_std: Option<Array> as Option<Vec<Option<Vec<f64>>>>,
        /// The queries where geometry has no meaning (null), or less accuracy than it seems.
        flags: Vec<Flag>,
        /// The numbers used, the method, its accuracy, and warnings.
        diagnostics: Diagnostics,
    }
}

answer! {
    /// The surface gradient as matrices.
    pub struct SurfaceGradientMatrixResponse {
        /// A matrix per coordinate, unit 1/length. Rows are queries, and columns are the points of `cloud`.
        ///
        /// A row is null where there is no normal.
        matrices: Array as Vec<Vec<Option<Vec<f64>>>>,
        /// The queries where geometry has no meaning (null), or less accuracy than it seems.
        flags: Vec<Flag>,
        /// The numbers used, the method, its accuracy, and warnings.
        diagnostics: Diagnostics,
    }
}

operation! {
/// Compute surface gradients
///
/// Returns the tangential part of the gradient of the function through the values, on the level surface of
/// the signature function.
pub async fn compute_surface_gradient(SurfaceGradientRequest) -> SurfaceGradientResponse;
path: "/v1/surface-gradient", tag: "operators", answer: "Surface gradients at the queries"
}

operation! {
/// Assemble surface gradient matrices
///
/// Returns a matrix per coordinate. It maps values at the nodes to that component of the surface gradient at
/// the queries.
pub async fn assemble_surface_gradient_matrix(SurfaceGradientMatrixRequest) -> SurfaceGradientMatrixResponse;
path: "/v1/surface-gradient/matrix", tag: "operators", answer: "The matrices"
}

impl Operation for SurfaceGradientRequest {
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
    ) -> Result<SurfaceGradientResponse, Problem> {
        let AppliedAnswer { values, deviations, flags, diagnostics } =
            work.apply(OPERATOR, fits, observer)?;
        Ok(SurfaceGradientResponse { gradients: values, gradient_std: deviations, flags, diagnostics })
    }
}

impl Operation for SurfaceGradientMatrixRequest {
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
    ) -> Result<SurfaceGradientMatrixResponse, Problem> {
        let MatrixAnswer { matrix, flags, diagnostics } = work.matrix(OPERATOR, fits, observer)?;
        Ok(SurfaceGradientMatrixResponse { matrices: matrix, flags, diagnostics })
    }
}

request! {
    /// A cloud of nodes on a surface, and queries for the rows of its sparse surface gradient matrices.
    pub struct SurfaceGradientSparseMatrixRequest with surface taking hyperparameters {
        /// The points to compute rows for, one row of each matrix. Default: the points of the surface.
        #[schema(value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
        pub queries: Option<Points>,
        /// The surface, if it differs from that of the request.
        pub surface: Option<Surface>,
    }
}

answer! {
    /// The components of the surface gradient as sparse matrices. Rows are queries, and columns are nodes.
    pub struct SurfaceGradientSparseMatrixResponse {
        /// The number of components, of queries and of nodes.
        shape: Integers as Vec<i64>,
        /// The position of the first entry of each row, from 0, and the number of all entries at the end.
        indptr: Integers as Vec<i64>,
        /// The column of each entry, from 0, ascending within a row.
        indices: Integers as Vec<i64>,
        /// The entries row by row, 1/length, as a list per component.
        data: Array as Vec<Vec<f64>>,
        /// The queries where geometry has no meaning (an empty row), or less accuracy than it seems.
        flags: Vec<Flag>,
        /// The numbers used for the surface, the method, its accuracy, and warnings.
        diagnostics: Diagnostics,
    }
}

operation! {
/// Assemble the sparse matrix of the surface gradient
///
/// Returns matrices whose rows weight the nodes near each query. Weights come from polyharmonic splines with
/// polynomials of degree 4 over the tangent plane. They are exact for these polynomials, and of third order
/// for second derivatives. The matrices need no kernel for values and take any number of nodes.
pub async fn assemble_surface_gradient_sparse_matrix(SurfaceGradientSparseMatrixRequest) -> SurfaceGradientSparseMatrixResponse;
path: "/v1/surface-gradient/sparse-matrix", tag: "operators", answer: "The matrix"
}

impl Operation for SurfaceGradientSparseMatrixRequest {
    type Work = StencilWork;

    fn plan(mut self, planner: &Planner<'_>) -> Result<Plan<StencilWork>, Problem> {
        let fit = self.take_fit();
        StencilWork::plan(planner, OPERATOR, fit, self.surface, self.queries)
    }

    fn compute(
        work: StencilWork,
        fits: &Fits,
        observer: &JobObserver,
    ) -> Result<SurfaceGradientSparseMatrixResponse, Problem> {
        let SparseAnswer { shape, indptr, indices, data, flags, diagnostics } =
            work.matrix(OPERATOR, fits, observer)?;
        Ok(SurfaceGradientSparseMatrixResponse { shape, indptr, indices, data, flags, diagnostics })
    }
}
