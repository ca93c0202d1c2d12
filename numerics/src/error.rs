//! The error type of the numerical layer, with its messages.

use gramian_observer::Cancelled;
use strum::{IntoStaticStr, VariantArray};

/// The result of a computation that may be refused.
pub type Result<T, E = NumericsError> = std::result::Result<T, E>;

/// A refusal of the numerics, named by its cause, with the index of the offending point if there is one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NumericsError {
    #[error("the cloud has no points")]
    EmptyCloud,
    #[error("points have no coordinates")]
    ZeroDimension,
    #[error("points[{point}] has {found} coordinates, the points before it have {expected}")]
    RaggedPoints { point: usize, expected: usize, found: usize },
    #[error("points[{point}][{coordinate}] is not finite")]
    NonFiniteCoordinate { point: usize, coordinate: usize },
    #[error("points[{point}][{coordinate}] is beyond 1e100 in magnitude")]
    CoordinateTooLarge { point: usize, coordinate: usize },
    #[error("the geometry of a hypersurface needs dimension 2 or more, the cloud has dimension {found}")]
    DimensionTooSmall { found: usize },
    #[error("expected dimension {expected}, found {found}")]
    DimensionMismatch { expected: usize, found: usize },
    #[error("expected {expected} entries, one per point, found {found}")]
    LengthMismatch { expected: usize, found: usize },
    #[error("kernel parameter {parameter} {requirement}")]
    InvalidKernelParameter { parameter: &'static str, requirement: &'static str },
    #[error("kernel parameter length_scales[{axis}] {requirement}")]
    InvalidLengthScale { axis: usize, requirement: &'static str },
    #[error("{parameter} {requirement}")]
    InvalidRegularization { parameter: &'static str, requirement: &'static str, point: Option<usize> },
    #[error("vary[{entry}] {requirement}")]
    InvalidVariation { entry: usize, requirement: &'static str },
    #[error(
        "the Wendland kernel is positive definite up to dimension {max_dimension}, the cloud has {dimension}"
    )]
    KernelNotPositiveDefinite { dimension: usize, max_dimension: usize },
    #[error(
        "the kernel has a kink at 0 and no gradient at query {query}, which is point {point} of the cloud"
    )]
    KernelNotSmooth { query: usize, point: usize },
    #[error("derivatives of order {order} of functions as rough as the kernel says have no finite variance")]
    DerivativesVary { order: usize },
    #[error("{} points coincide with another one and alpha is 0", points.len())]
    DuplicatePoints {
        /// Every point that coincides with another one, ascending.
        points: Vec<usize>,
    },
    #[error("K + alpha I is not positive definite in float64: {reason}")]
    NotPositiveDefinite { reason: NotDefinite, minimum_alpha: f64 },
    #[error("the points do not determine this mean: they lie in one hyperplane, or there are too few")]
    MeanNotDetermined,
    #[error("the answer at query {query} is outside the range of float64")]
    Overflow { query: usize },
    #[error("the weights are outside the range of float64")]
    WeightsOverflow,
    #[error("the {solver:?} solver does not serve {quantity:?}")]
    Unsupported { solver: SolverKind, quantity: Quantity },
    #[error("{n_bytes} bytes of memory cannot be allocated")]
    OutOfMemory { n_bytes: usize },
    #[error("tiles[{tile}] {requirement}")]
    InvalidTile { tile: usize, requirement: &'static str },
    #[error("tiles[{tile}].regions[{region}] {requirement}")]
    InvalidRegion { tile: usize, region: usize, requirement: &'static str },
    #[error("links[{link}] names a region that no tile has")]
    InvalidLink { link: usize },
    #[error(
        "the points do not enclose a volume: only {:.0} % of them have an inside and an outside; let the surface be open \
         if it ends with its points, or give them normals outward",
        100.0 * closedness
    )]
    OpenSurface {
        /// Share of the points with two sides.
        closedness: f64,
    },
    #[error(
        "{:.0} % of the vertices of the mesh are farther than three spacings from all points; ask for the surface local, let it \
         be open if it ends with its points, or set bounds",
        100.0 * share
    )]
    UnsupportedMesh {
        /// Share of the vertices that are far from all points.
        share: f64,
    },
    #[error(
        "the surface needs more than {limit} nodes of a lattice with this step; make it longer, or set bounds"
    )]
    TooManyNodes { limit: usize },
    #[error(
        "the kernel needs more than {most} landmarks for these points: it is too rough, or its length scale too short"
    )]
    RankTooLarge { most: usize },
    #[error(
        "the iteration ends at a relative residual of {relative_residual:.1e}, above the tolerance of {tolerance:.1e}"
    )]
    NotConverged { relative_residual: f64, tolerance: f64 },
    #[error("the computation was cancelled")]
    Cancelled,
}

impl From<Cancelled> for NumericsError {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

/// The reason why a system has no trustworthy answer without more regularization.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NotDefinite {
    #[error("the solve leaves a relative residual of {relative_residual:.1e}")]
    Residual { relative_residual: f64 },
    #[error("the solve leaves a backward error of {backward_error:.1e}")]
    BackwardError { backward_error: f64 },
    #[error("Cholesky fails at point {point}, and the answer needs its factor")]
    NeedsCholesky { point: usize },
    #[error("Cholesky fails, and the answer needs its factor")]
    Unfactorable,
    #[error("the reciprocal condition {reciprocal_condition:.1e} leaves no correct digit of the answer")]
    Singular { reciprocal_condition: f64 },
    #[error("the variance at query {query} is {variance:.1e}, beyond rounding")]
    NegativeVariance { query: usize, variance: f64 },
}

/// A solver of the kernel system. Its name is the variant in lower case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "snake_case")]
pub enum SolverKind {
    /// A factorization of the whole matrix.
    Dense,
    /// Weights at a few points, whose kernels span those of the others.
    Landmark,
    /// Conjugate gradients.
    Iterative,
    /// Local fits to the nearest points of each query.
    Local,
}

/// A quantity that not every solver can compute.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// The diagonal of `(K + αI)⁻¹`.
    InverseDiagonal,
    /// The likelihood, or its determinant.
    Likelihood,
    /// A matrix with a column for each point.
    DenseMatrix,
    /// Values at queries, for which the solver has no weights.
    Values,
    /// Normals and curvatures in this dimension.
    Geometry,
    /// Regions of a tile.
    Regions,
}
