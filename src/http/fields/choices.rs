//! Options of a request that are chosen by a word.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use gramian_numerics::regression::solver::trend::Mean;

/// The method that solves the linear system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
#[value(rename_all = "snake_case")]
pub enum SolverChoice {
    /// The service chooses.
    #[default]
    Auto,
    /// Cholesky factorization of the full matrix: n³/3 flops, 4n² bytes.
    Dense,
    /// Weights at a few hundred to a few thousand of the points, whose kernels span those of all others: for
    /// smooth kernels and up to millions of points.
    Landmark,
    /// Conjugate gradients on the full system, until the residual is within the tolerance: for rough kernels
    /// and up to a million points.
    Iterative,
    /// Uses only the points nearest to each query: kriging for values, regressions for surfaces. For
    /// thousands to millions of points.
    Local,
}

/// The treatment of points that coincide when alpha is 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
#[value(rename_all = "snake_case")]
pub enum DuplicatePolicy {
    /// Answer 422 `duplicate-points`.
    #[default]
    Refuse,
    /// Average their values. In matrices, the columns of merged points split the weight equally.
    Merge,
}

/// The mean of a function: its part beside the kernel, which it tends to far from the points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeanChoice {
    /// 0.
    Zero,
    /// A constant, estimated from the values by generalised least squares.
    Constant,
    /// A constant and a slope per coordinate, estimated from the values by generalised least squares.
    Linear,
}

impl From<MeanChoice> for Mean {
    fn from(choice: MeanChoice) -> Self {
        match choice {
            MeanChoice::Zero => Self::Zero,
            MeanChoice::Constant => Self::Constant,
            MeanChoice::Linear => Self::Linear,
        }
    }
}

/// The function whose level set is the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
#[value(rename_all = "snake_case")]
pub enum SurfaceModelChoice {
    /// `signature`, replaced by `offset` where its gradient vanishes or, for curvatures, is weak.
    #[default]
    Auto,
    /// The signature function: the interpolant of the constant 1.
    Signature,
    /// An interpolant of signed distances on two offset layers, fitted to the points near each query. It
    /// needs no derivatives of `kernel`.
    Offset,
    /// Local regressions of the height over a tangent plane, with noise.
    Regression,
}

/// The function whose level surface was used at a query.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SurfaceModelUsed {
    /// The signature function: the interpolant of the constant 1.
    Signature,
    /// The interpolant of signed distances on two offset layers.
    Offset,
    /// A local regression.
    Regression,
}

/// The direction of normals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum OrientationChoice {
    /// Normals point outward, so a sphere has positive curvatures.
    ///
    /// If the cloud has normals, their side is outward. Otherwise normals point out of closed surfaces:
    /// against the gradient of the signature function, with signs repaired where neighbours contradict it.
    #[default]
    Outward,
    /// Along the gradient of the signature function, whatever its sign. With the offset model, the opposite
    /// of `outward`.
    Gradient,
}

/// Optional parts of an answer about values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ValueAttribute {
    /// Standard deviations, given the values.
    Std,
}

/// Optional parts of a geometric answer.
///
/// `std` are standard deviations. A point of the cloud is off the surface by its noise, which moved it
/// along the surface as well. Deviations at a query that is a point, and those without queries, count that
/// too. Any other query is a place that is known exactly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum GeometryAttribute {
    /// Standard deviations.
    Std,
    /// The normals of both sheets at sharp edges. Takes local regressions.
    EdgeNormals,
}
