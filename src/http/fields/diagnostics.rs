//! Diagnostics of an answer: the numbers used, the method, its accuracy, and warnings.

use serde::Serialize;
use utoipa::ToSchema;

use super::hyperparameters::Hyperparameters;
use super::kernel::KernelUsed;
use super::schemas::CloudIdSchema;
use gramian_host::json_members;
use gramian_numerics::error::SolverKind;
use gramian_numerics::operators::{RowKind, Stencils};
use gramian_numerics::regression::solver::{Autocorrelation, Disagreement, Outlier, Place};

/// The factorization of the Gram matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FactorizationUsed {
    /// Cholesky, exact up to rounding.
    Cholesky,
    /// Rank-revealing pivoted Cholesky and least squares on its pivots, used where Cholesky fails in float64.
    PivotedCholesky,
    /// Cholesky of the normal equations of landmarks.
    Landmark,
    /// Conjugate gradients, preconditioned by a sparse factor of the inverse.
    ConjugateGradients,
    /// None. Small systems of the points nearest to each query are solved instead.
    Local,
}

/// The solver that was used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SolverUsed {
    /// A factorization of the full matrix.
    Dense,
    /// Weights at a few of the points, whose kernels span those of all others.
    Landmark,
    /// Conjugate gradients on the full system.
    Iterative,
    /// Small systems of the points nearest to each query.
    Local,
}

impl From<SolverKind> for SolverUsed {
    fn from(kind: SolverKind) -> Self {
        match kind {
            SolverKind::Dense => Self::Dense,
            SolverKind::Landmark => Self::Landmark,
            SolverKind::Iterative => Self::Iterative,
            SolverKind::Local => Self::Local,
        }
    }
}

/// The subject of a warning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WarningCode {
    /// Digits of the weights are lost: their relative error may reach machine precision divided by the
    /// reciprocal condition.
    IllConditioned,
    /// A step of iterative refinement reduced the residual.
    Refined,
    /// Points that coincide were merged.
    DuplicatesMerged,
    /// A variance was adjusted to the range of float64.
    ///
    /// Variances that came out negative within rounding are served as 0. If squares of the values leave
    /// float64, the variance of the values is taken to be 1e-290.
    VarianceClamped,
    /// The offset model was used where the signature function fails.
    OffsetModelUsed,
    /// The gradient of the signature function pointed inward at some points. `outward` is the repaired side.
    OrientationRepaired,
    /// The cloud is open, so outward has no meaning.
    OpenCloud,
    /// The kernel's cusp shows at the points of the cloud.
    KernelTooRough,
    /// The points around a query do not confirm its curvatures.
    DisagreesWithNeighbours,
    /// Queries lie far from the cloud.
    FarFromCloud,
    /// Queries are at sharp edges, where two sheets of the surface meet.
    SharpEdges,
    /// Values from the points nearest to a query still change with the number of points used.
    NeighboursNotEnough,
    /// Regular triangles would have changed the topology of a mesh, so it has the raw ones.
    RawMesh,
    /// Small parts of a level set were left out of its mesh.
    PartsDropped,
    /// A mesh goes on where there are no points.
    Bridged,
    /// Vertices of a mesh are farther than three spacings from all points.
    FarVertices,
    /// Values contradict kernel and noise, so deviations are too short. If the warning names a value, perhaps
    /// only around it.
    PoorFit,
    /// Rows repeat points and values of an earlier one. They count once when kernel and noise are learned.
    RepeatedRows,
    /// Coordinates of the points have so different spreads that one length scale does not serve them all.
    UnitsDiffer,
}

/// Something that was changed, or that limits the accuracy of the answer.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct Warning {
    /// The subject of the warning.
    pub code: WarningCode,
    /// The warning in words, with numbers.
    pub detail: String,
}

/// Diagnostics of an answer: the numbers used, the method, and its accuracy.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct Diagnostics {
    /// The id of the cloud, to refer to it in later requests.
    #[schema(value_type = CloudIdSchema)]
    pub cloud_id: String,
    /// Number of points of the cloud, n.
    pub n_points: usize,
    /// Number of queries answered, m.
    pub n_queries: usize,
    /// Number of coordinates of each point, d.
    pub dimension: usize,
    /// The kernel used, with all parameters.
    pub kernel: KernelUsed,
    /// The number added to the diagonal. Absent with `noise_variances`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha: Option<f64>,
    /// The solver used.
    pub solver: SolverUsed,
    /// The reason why `auto` chose a solver other than the dense one. Absent otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub solver_reason: Option<String>,
    /// The factorization of the matrix.
    pub factorization: FactorizationUsed,
    /// Numerical rank of the matrix, or the number of landmarks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rank: Option<usize>,
    /// Largest entry of the diagonal of K that the landmarks leave, over all points. Only with the solver
    /// `landmark`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub remaining_diagonal: Option<f64>,
    /// Largest entry of the diagonal that the landmarks were allowed to leave, unit of the values squared: a
    /// millionth of the noise or less. Only with the solver `landmark`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub diagonal_tolerance: Option<f64>,
    /// Largest relative residual that was allowed. Only with the solver `iterative`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Number of iterations of conjugate gradients, with the solvers `iterative` and `landmark`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iterations: Option<usize>,
    /// Estimate of 1/(‖K + αI‖₁‖(K + αI)⁻¹‖₁): roughly the fraction of digits that survive. For landmarks,
    /// that of their normal equations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reciprocal_condition: Option<f64>,
    /// ‖Y − (K + αI)Λ‖/‖Y‖ of the solve, where Y is the values without their mean. For matrices and surfaces,
    /// Y = 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative_residual: Option<f64>,
    /// ‖u‖² = ΛᵀKΛ, the squared norm in the native space of the kernel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub native_norm_squared: Option<f64>,
    /// The mean of the function: the constant, then a slope per coordinate if it is linear. Absent if the
    /// mean is 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_coefficients: Option<Vec<f64>>,
    /// |u(X) − Y|, unit of the values.
    ///
    /// Absent for values from the local solver, which is not evaluated at the points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub misfit: Option<f64>,
    /// Estimated standard deviation of the noise of the points across the surface, length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_deviation: Option<f64>,
    /// What local regressions learned of the cloud, or were given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hyperparameters: Option<Hyperparameters>,
    /// Number of positions around a point on which the answer there depends, with local regressions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reach: Option<usize>,
    /// Number of points that were merged into an earlier point.
    pub n_merged_duplicates: usize,
    /// Number of rows of a sparse operator by how their weights were computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stencils: Option<StencilCounts>,
    /// Changes that were made, and limits of the accuracy.
    pub warnings: Vec<Warning>,
    /// Diagnostics of the fit of the surface, in answers about values on a surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(no_recursion)]
    pub surface: Option<Box<Diagnostics>>,
}

/// Number of rows of a sparse operator by how their weights were computed.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
pub struct StencilCounts {
    /// Polyharmonic splines on the nearest nodes: the ordinary row.
    pub nearest: usize,
    /// Polyharmonic splines on nodes that thin out with distance, used where the nearest nodes lie on one
    /// side.
    pub graded: usize,
    /// Weights that are not negative beside the diagonal, used where no splines give a stable row, as at a
    /// rim.
    pub positive: usize,
    /// Least squares of least norm, used where the nodes do not determine derivatives.
    pub least_norm: usize,
    /// Rows without entries.
    pub empty: usize,
}

impl StencilCounts {
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
    /// Warns of queries at which a variance came out negative within rounding, if there are any.
    pub fn warn_of_clamping(&mut self, queries: &[usize]) {
        let Some(first) = queries.first() else { return };
        let detail = format!(
            "variances were negative by rounding and are set to 0 (queries: {}, the first of them {first})",
            queries.len()
        );
        self.warnings.push(Warning { code: WarningCode::VarianceClamped, detail });
    }

    /// Warns that values contradict kernel and noise, and suggests a remedy.
    pub fn warn_of_poor_fit(&mut self, found: Disagreement, remedy: &str) {
        let spread = found.mean_square.sqrt();
        let detail = match (found.outlier, found.place, found.autocorrelation) {
            (Some(Outlier { point, deviations }), _, _) => format!(
                "the value of point {point} is {deviations:.1} deviations from what others say of it, and all are {spread:.1} in root mean \
                 square; {remedy}"
            ),
            (None, Some(Place { point, n_points, deviations }), _) => format!(
                "the {n_points} values around point {point} are {deviations:.1} deviations from what others say \
                 of them in root mean square, and all are {spread:.1}; {remedy}"
            ),
            (None, None, Some(Autocorrelation { coefficient, n_pairs })) => format!(
                "residuals of near points are correlated ({coefficient:.2} over {n_pairs} pairs), as those of noise are not: detail finer than the \
                 length scale is taken for noise, and deviations of the function leave it out; add points where detail matters, or use a \
                 kernel with a shorter length scale"
            ),
            (None, None, None) => format!(
                "values are {spread:.1} deviations from what others say of them in root mean square; {remedy}"
            ),
        };
        self.warnings.push(Warning { code: WarningCode::PoorFit, detail });
    }

    /// Warns that neighbourhoods are too small.
    ///
    /// `std` is by how many deviations values from half of a neighbourhood differ from those of all of
    /// it.
    pub fn warn_of_unsettled(&mut self, deviations: Option<f64>) {
        let Some(deviations) = deviations else { return };
        let detail = format!(
            "values from half of the nearest points differ by {deviations:.1e} deviations in root mean square: points beyond the nearest may \
             matter; take a shorter length scale, less noise, or \"solver\": \"dense\""
        );
        self.warnings.push(Warning { code: WarningCode::NeighboursNotEnough, detail });
    }
}

json_members!(Diagnostics);

/// The reason why a query has a flag.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FlagReason {
    /// The gradient of the signature function vanishes, and the offset model was not tried or failed: the
    /// entry is null.
    VanishingGradient,
    /// The points around the query do not confirm its curvatures. The number is served.
    UnderResolved,
    /// Evidence about the outward side is contradictory. The normal is served, and may point inward.
    AmbiguousSide,
    /// Two sheets of the surface meet here at a sharp edge. What is served is that of one of them, or of
    /// neither.
    Edge,
    /// The number is served, but is uncertain or depends on derivatives that the kernel lacks.
    ///
    /// Uncertain means that its error, as estimated from the values, exceeds a fifth of the root mean square
    /// over the queries.
    Uncertain,
    /// The kernel's cusp at the points shows in the curvatures, which may be off by factors. The number is
    /// served.
    KernelTooRough,
    /// The query is farther from the cloud than three spacings. The number is served.
    FarFromCloud,
    /// The offset model would cost more than is admitted. The entry is null.
    UnaffordableRescue,
}

/// A query where geometry has no meaning, or less accuracy than it seems.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct Flag {
    /// The position of the query.
    pub query: usize,
    /// The reason why the query has a flag.
    pub reason: FlagReason,
    /// |∇| of the function used at the query.
    ///
    /// Its unit is 1/length for the signature function. It is about 1 for the offset model, and 0 where that
    /// has no answer.
    pub gradient_norm: f64,
}
