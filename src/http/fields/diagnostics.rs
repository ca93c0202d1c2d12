//! What an answer says of itself.

use serde::Serialize;
use utoipa::ToSchema;

use super::kernel::KernelUsed;
use super::schemas::CloudIdSchema;
use crate::http::problem::Problem;
use crate::http::wire::write::answer::{Member, Parts};
use gramian_numerics::solver::{Disagreement, Outlier, Place};
use gramian_numerics::surface::operators::{RowKind, Stencils};

/// How the Gram matrix was factorized. `bunch_kaufman`, `partial_pivoting_lu` and `conjugate_gradients` are reserved: no
/// answer has them yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FactorizationUsed {
    /// Cholesky, exact up to rounding.
    Cholesky,
    /// Rank-revealing pivoted Cholesky and least squares on its pivots, where Cholesky fails in float64.
    PivotedCholesky,
    /// Reserved for a symmetric indefinite factorization.
    BunchKaufman,
    /// Reserved for LU with partial pivoting.
    PartialPivotingLu,
    /// Reserved for iterative solvers.
    ConjugateGradients,
    /// None: small systems of the points nearest to each query.
    Local,
}

/// The solver that was used. `landmark` and `iterative` are reserved: no answer has them yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SolverUsed {
    /// A factorization of the full matrix.
    Dense,
    /// Reserved for a low-rank factorization.
    Landmark,
    /// Reserved for preconditioned conjugate gradients.
    Iterative,
    /// The points nearest to each query.
    Local,
}

/// What a warning is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WarningCode {
    /// Digits of the weights are lost: their relative error may reach machine precision over the reciprocal condition.
    IllConditioned,
    /// A step of iterative refinement reduced the residual.
    Refined,
    /// Points that coincide were merged.
    DuplicatesMerged,
    /// Variances that came out negative within rounding are served as 0, that of values whose squares leave float64 as 1e-290.
    VarianceClamped,
    /// The offset model served where the signature function could not.
    OffsetModelUsed,
    /// The gradient of the signature function pointed inward at some points; `outward` is the repaired side.
    OrientationRepaired,
    /// The cloud is open, so that outward has no meaning.
    OpenCloud,
    /// The kernel's cusp is seen at the points of the cloud.
    KernelTooRough,
    /// Curvatures are not confirmed by the points around the query.
    DisagreesWithNeighbours,
    /// Queries lie far from the cloud.
    FarFromCloud,
    /// Values from the points nearest to a query still change with how many of them are taken.
    NeighboursNotEnough,
    /// Values contradict kernel and noise: deviations are too short, where one value is named perhaps around it alone.
    Misfit,
}

/// Something that was changed, or that limits the accuracy of the answer.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct Warning {
    /// What it is about.
    pub code: WarningCode,
    /// The same in words, with numbers.
    pub detail: String,
}

/// What an answer says of itself: the numbers used, how the system was solved, and how well.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct Diagnostics {
    /// The id of the cloud, to refer to it in later requests.
    #[schema(value_type = CloudIdSchema)]
    pub cloud_id: String,
    /// Points of the cloud, n.
    pub n_points: usize,
    /// Queries answered, m.
    pub n_queries: usize,
    /// Coordinates of each point, d.
    pub dimension: usize,
    /// The kernel used, in full.
    pub kernel: KernelUsed,
    /// What was added to the diagonal; absent with `noise_variances`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub alpha: Option<f64>,
    /// The solver used.
    pub solver: SolverUsed,
    /// Why it was chosen, where `auto` chose another one than the dense one.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub solver_reason: Option<String>,
    /// How the matrix was factorized.
    pub factorization: FactorizationUsed,
    /// Numerical rank of the matrix.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub rank: Option<usize>,
    /// Estimate of 1/(‖K + αI‖₁‖(K + αI)⁻¹‖₁): about how many digits survive, as a fraction of all.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub reciprocal_condition: Option<f64>,
    /// ‖Y − (K + αI)Λ‖/‖Y‖ of the solve, Y without its mean; for matrices and surfaces, with Y = 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub relative_residual: Option<f64>,
    /// ‖u‖² = ΛᵀKΛ in the native space of the kernel.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub native_norm_squared: Option<f64>,
    /// The mean of the function: the constant, then a slope for each coordinate if it is linear; absent where it is 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub mean_coefficients: Option<Vec<f64>>,
    /// |u(X) − Y|, unit of the values; absent for values from the local solver, which is not asked at the points.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub misfit: Option<f64>,
    /// Standard deviation of the noise of the points across the surface, as estimated, length.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub noise_deviation: Option<f64>,
    /// Points that were merged into an earlier one.
    pub n_merged_duplicates: usize,
    /// Rows of a sparse operator by how their weights came about.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub stencils: Option<StencilsUsed>,
    /// What was changed or limits the accuracy.
    pub warnings: Vec<Warning>,
    /// The same for the fit of the surface, in answers about values on a surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, no_recursion)]
    pub geometry: Option<Box<Diagnostics>>,
}

/// Rows of a sparse operator by how their weights came about.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
pub struct StencilsUsed {
    /// Polyharmonic splines on the nearest nodes: the ordinary row.
    pub nearest: usize,
    /// Polyharmonic splines on nodes that are sparser the farther they are, where the nearest ones lie on one side.
    pub graded: usize,
    /// Weights without negative ones beside the diagonal, where no splines give a stable row, as at a rim.
    pub positive: usize,
    /// Least squares of the least norm, where the nodes do not determine derivatives.
    pub least_norm: usize,
    /// Rows without entries.
    pub empty: usize,
}

impl StencilsUsed {
    pub fn of(stencils: &Stencils) -> Self {
        Self {
            nearest: stencils.n_rows(RowKind::Nearest),
            graded: stencils.n_rows(RowKind::Graded),
            positive: stencils.n_rows(RowKind::Positive),
            least_norm: stencils.n_rows(RowKind::LeastNorm),
            empty: stencils.n_rows(RowKind::Empty),
        }
    }
}

impl Diagnostics {
    /// Says at which queries a variance came out negative within rounding, if at any.
    pub fn warn_of_clamping(&mut self, queries: &[usize]) {
        let Some(first) = queries.first() else { return };
        let detail = format!(
            "variances came out negative within rounding and are served as 0 (queries: {}, the first of them {first})",
            queries.len()
        );
        self.warnings.push(Warning { code: WarningCode::VarianceClamped, detail });
    }
}

impl Diagnostics {
    /// Says how values contradict kernel and noise, with what helps.
    pub fn warn_of_misfit(&mut self, found: Disagreement, remedy: &str) {
        let spread = found.mean_square.sqrt();
        let detail = match (found.outlier, found.place) {
            (Some(Outlier { point, deviations }), _) => format!(
                "the value of point {point} is {deviations:.1} deviations from what others say of it, and all are {spread:.1} in root mean \
                 square; {remedy}"
            ),
            (None, Some(Place { point, n_points, deviations })) => format!(
                "the {n_points} values around point {point} are {deviations:.1} deviations from what others say \
                 of them in root mean square, and all are {spread:.1}; {remedy}"
            ),
            (None, None) => format!(
                "values are {spread:.1} deviations from what others say of them in root mean square; {remedy}"
            ),
        };
        self.warnings.push(Warning { code: WarningCode::Misfit, detail });
    }
}

impl Diagnostics {
    /// Says that neighbourhoods are too small, and by how many deviations half of one differs from all of it.
    pub fn warn_of_unsettled(&mut self, deviations: Option<f64>) {
        let Some(deviations) = deviations else { return };
        let detail = format!(
            "values from half of the nearest points differ by {deviations:.1e} deviations in root mean square: points beyond the nearest may \
             matter; take a shorter length scale, less noise, or \"solver\": \"dense\""
        );
        self.warnings.push(Warning { code: WarningCode::NeighboursNotEnough, detail });
    }
}

impl Member for Diagnostics {
    fn add_to(self, name: &'static str, parts: &mut Parts) -> Result<(), Problem> {
        parts.add_json(name, &self)
    }
}

/// Why a query is degenerate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum DegenerateReason {
    /// The gradient of the signature function vanishes, and the offset model was not asked or has no answer: the entry is
    /// null.
    VanishingGradient,
    /// The points around the query do not confirm its curvatures; the number is served.
    UnderResolved,
    /// What is known of the side contradicts itself: the normal is served, and may point inward.
    AmbiguousSide,
    /// What is served of values is off by more than a fifth of its root mean square over the queries, as far as the values say, or the kernel has no
    /// such derivatives; the number is served.
    Uncertain,
    /// The kernel's cusp at the points shows in the curvatures, which may be off by factors; the number is served.
    KernelTooRough,
    /// The query is farther from the cloud than three spacings; the number is served.
    FarFromCloud,
    /// The offset model would cost more than is admitted; the entry is null.
    UnaffordableRescue,
}

/// A query where geometry has no meaning, or less accuracy than it seems.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct Degenerate {
    /// The position of the query.
    pub query: usize,
    /// Why.
    pub reason: DegenerateReason,
    /// |∇| of the function that was asked there: 1/length for the signature function, about 1 for the offset model, 0
    /// where that has no answer.
    pub gradient_norm: f64,
}
