//! What a request leaves to the service or decides, by words.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use gramian_numerics::solver::trend::Mean;

/// How the linear system is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SolverChoice {
    /// The service chooses.
    #[default]
    Auto,
    /// Cholesky factorization of the full matrix: n³/3 flops, 4n² bytes.
    Dense,
    /// From the points nearest to each query alone: values by kriging, surfaces by regressions. From thousands of points to
    /// millions.
    Local,
}

/// What to do with points that coincide when alpha is 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum DuplicatePolicy {
    /// Answer 422 `duplicate-points`.
    #[default]
    Refuse,
    /// Average their values; columns of matrices split the weight equally.
    Merge,
}

/// The mean of a function: what it is made of beside the kernel, and tends to far from the points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeanChoice {
    /// 0.
    Zero,
    /// A constant, found from the values by generalised least squares.
    Constant,
    /// A constant and a slope for each coordinate, likewise.
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

/// Which function's level surface is meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SurfaceChoice {
    /// `signature`, and `offset` where its gradient vanishes or, for curvatures, is weak.
    #[default]
    Auto,
    /// The interpolant of the constant 1.
    Signature,
    /// An interpolant of signed distances on two offset layers, fitted to the points near each query. It needs no derivatives
    /// of `kernel`.
    Offset,
    /// Local regressions of the height over a tangent plane, with noise.
    Local,
}

/// The function whose level surface was used at a query.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SurfaceUsed {
    /// The interpolant of the constant 1.
    Signature,
    /// The interpolant of signed distances on two offset layers.
    Offset,
    /// A local regression.
    Local,
}

/// Which way normals point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum OrientationChoice {
    /// To the side of the cloud's normals where it has some; else out of closed surfaces, against the gradient of the
    /// signature function, with signs repaired where neighbours contradict it. A sphere has positive curvatures.
    #[default]
    Outward,
    /// Along the gradient of the signature function, whatever its sign; with the offset model, the opposite of `outward`.
    Gradient,
}

/// What an answer about values has beside what it always has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ValuesInclude {
    /// Standard deviations, given the values.
    Deviations,
}

/// What a geometric answer has beside what it always has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum GeometryInclude {
    /// Standard deviations.
    Deviations,
}
