//! The objects that requests and answers share: CloudRef, Kernel, Fit, Geometry, Diagnostics, Degenerate.

pub mod kernel;
pub mod schemas;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::http::problem::Problem;
use crate::http::wire::read::members::{present, present_object, present_unless_empty, present_word, word};
use crate::http::wire::read::points::Points;
use crate::http::wire::write::answer::{Member, Parts};
use crate::http::wire::write::array::finite;
use schemas::{CloudIdSchema, Smoothness};

/// A cloud: the id of a registered one, or its points. Exactly one of `id` and `points` is given.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CloudRef {
    /// The id of a registered cloud, 64 hexadecimal digits.
    #[serde(default, deserialize_with = "present")]
    #[schema(nullable = false, value_type = Option<CloudIdSchema>)]
    pub id: Option<String>,
    /// The points, one row of coordinates each, all of the same length; the cloud is registered with them.
    #[serde(default, deserialize_with = "present")]
    #[schema(nullable = false, value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
    pub points: Option<Points>,
    /// Normals at the points, one row each, of any length but 0, with `points` only. Their side is outward. An empty list
    /// counts as absent.
    #[serde(default, deserialize_with = "present_unless_empty")]
    #[schema(nullable = false, value_type = Option<Vec<Vec<f64>>>)]
    pub normals: Option<Points>,
}

/// The families of kernels; `GET /v1/kernels` has their formulas.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum KernelFamily {
    Gauss,
    Laplace,
    Matern,
    Wendland,
    InverseMultiquadric,
}

/// A radial kernel `k(x, y) = variance · φ(|x − y|²/length_scale²)`. A parameter of another family is refused.
#[derive(Debug, Clone, PartialEq, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Kernel {
    /// The family, which determines φ.
    #[serde(deserialize_with = "word")]
    pub family: KernelFamily,
    /// The length scale ℓ, in the unit of the coordinates; chosen from the cloud if absent.
    #[serde(default, deserialize_with = "present")]
    #[schema(nullable = false, exclusive_minimum = 0.0)]
    pub length_scale: Option<f64>,
    /// The factor of φ, unit of the values squared; 1 if absent.
    #[serde(default, deserialize_with = "present")]
    #[schema(nullable = false, exclusive_minimum = 0.0)]
    pub variance: Option<f64>,
    /// laplace: φ = exp(−√(r² + epsilon)); 0 if absent, which leaves a kink at the points of the cloud.
    #[serde(default, deserialize_with = "present")]
    #[schema(nullable = false, minimum = 0.0)]
    pub epsilon: Option<f64>,
    /// matern: one of 0.5, 1.5, …, 8.5; 2.5 if absent. (A range in the schema: generators know no enumerations of fractions.)
    #[serde(default, deserialize_with = "present")]
    #[schema(nullable = false, minimum = 0.5, maximum = 8.5, multiple_of = 0.5)]
    pub nu: Option<f64>,
    /// wendland: 2, 4 or 6 times differentiable; 4 if absent.
    #[serde(default, deserialize_with = "present")]
    #[schema(nullable = false, value_type = Option<Smoothness>)]
    pub smoothness: Option<u8>,
}

/// The kernel that was used, every number of it: sent back as `kernel` it gives the same answer.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct KernelUsed {
    /// The family, which determines φ.
    pub family: KernelFamily,
    /// The length scale ℓ, in the unit of the coordinates.
    pub length_scale: f64,
    /// The factor of φ, unit of the values squared.
    pub variance: f64,
    /// laplace: φ = exp(−√(r² + epsilon)).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub epsilon: Option<f64>,
    /// matern: the smoothness ν.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub nu: Option<f64>,
    /// wendland: how often differentiable.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, value_type = Option<Smoothness>)]
    pub smoothness: Option<u8>,
}

/// How the linear system is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SolverChoice {
    /// The service chooses.
    #[default]
    Auto,
    /// Cholesky factorization of the full matrix: n³/3 flops, 4n² bytes.
    Dense,
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
}

/// The function whose level surface was used at a query.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SurfaceUsed {
    /// The interpolant of the constant 1.
    Signature,
    /// The interpolant of signed distances on two offset layers.
    Offset,
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

/// The surface of an operator, where it comes from another cloud, kernel or alpha than the values. What is absent is as in
/// the request.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Geometry {
    /// The cloud whose level surface carries the operator.
    #[serde(default, deserialize_with = "present_object")]
    #[schema(nullable = false)]
    pub cloud: Option<CloudRef>,
    /// The kernel of its signature function.
    #[serde(default, deserialize_with = "present_object")]
    #[schema(nullable = false)]
    pub kernel: Option<Kernel>,
    /// Added to the diagonal of its Gram matrix.
    #[serde(default, deserialize_with = "present")]
    #[schema(nullable = false, minimum = 0.0)]
    pub alpha: Option<f64>,
    /// One entry per point of its cloud, instead of `alpha`. An empty list counts as absent.
    #[serde(default, deserialize_with = "present_unless_empty")]
    #[schema(nullable = false)]
    pub noise_variances: Option<Vec<f64>>,
    /// How its linear system is solved.
    #[serde(default, deserialize_with = "present_word")]
    #[schema(nullable = false)]
    pub solver: Option<SolverChoice>,
    /// Which function's level surface is meant.
    #[serde(default, deserialize_with = "present_word")]
    #[schema(nullable = false)]
    pub surface: Option<SurfaceChoice>,
}

/// The fields of a request that determine its fit, taken out of it.
#[derive(Debug, Default)]
pub struct Fit {
    pub cloud: CloudRef,
    pub kernel: Option<Kernel>,
    pub alpha: Option<f64>,
    pub noise_variances: Option<Vec<f64>>,
    pub solver: SolverChoice,
    pub duplicates: DuplicatePolicy,
}

/// Declares a request: the fields of a fit, which stand directly in it, and its own.
macro_rules! request {
    (
        $(#[$meta:meta])*
        pub struct $name:ident { $($(#[$field_meta:meta])* pub $field:ident: $type:ty,)* }
    ) => {
        $(#[$meta])*
        #[derive(Debug, serde::Deserialize, utoipa::ToSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            /// The points where values are known, or that sample the surface.
            #[serde(deserialize_with = "crate::http::wire::read::members::object")]
            pub cloud: $crate::http::fields::CloudRef,
            /// The kernel; chosen from the cloud if absent, `alpha` included, and repeated in the diagnostics.
            #[serde(default, deserialize_with = "crate::http::wire::read::members::present_object")]
            #[schema(nullable = false)]
            pub kernel: Option<$crate::http::fields::Kernel>,
            /// Added to the diagonal of the Gram matrix as given, unit of the values squared: 0 interpolates, the variance
            /// of the noise regresses. Absent: 1e-10 for values or with a kernel given; for surfaces without one, chosen by
            /// the noise of the points, 1e-3 at least.
            #[serde(default, deserialize_with = "crate::http::wire::read::members::present")]
            #[schema(nullable = false, minimum = 0.0)]
            pub alpha: Option<f64>,
            /// The variance of the noise at each point, instead of `alpha`. An empty list counts as absent.
            #[serde(default, deserialize_with = "crate::http::wire::read::members::present_unless_empty")]
            #[schema(nullable = false)]
            pub noise_variances: Option<Vec<f64>>,
            /// How the linear system is solved.
            #[serde(default, deserialize_with = "crate::http::wire::read::members::present_word")]
            #[schema(nullable = false)]
            pub solver: Option<$crate::http::fields::SolverChoice>,
            /// What to do with points that coincide when alpha is 0.
            #[serde(default, deserialize_with = "crate::http::wire::read::members::present_word")]
            #[schema(nullable = false)]
            pub duplicates: Option<$crate::http::fields::DuplicatePolicy>,
            $($(#[$field_meta])* pub $field: $type,)*
        }

        impl $name {
            /// Takes the fields of the fit out.
            fn take_fit(&mut self) -> $crate::http::fields::Fit {
                $crate::http::fields::Fit {
                    cloud: std::mem::take(&mut self.cloud),
                    kernel: self.kernel.take(),
                    alpha: self.alpha,
                    noise_variances: self.noise_variances.take(),
                    solver: self.solver.unwrap_or_default(),
                    duplicates: self.duplicates.unwrap_or_default(),
                }
            }
        }
    };
}
pub(crate) use request;

/// How the Gram matrix was factorized. `bunch_kaufman`, `partial_pivoting_lu`, `conjugate_gradients` and `local` are reserved: no
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
    /// Reserved for local patches.
    Local,
}

/// The solver that was used. `landmark`, `iterative` and `local` are reserved: no answer has them yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SolverUsed {
    /// A factorization of the full matrix.
    Dense,
    /// Reserved for a low-rank factorization.
    Landmark,
    /// Reserved for preconditioned conjugate gradients.
    Iterative,
    /// Reserved for local patches.
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
    /// Variances that came out negative within rounding are served as 0.
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
    /// How the matrix was factorized.
    pub factorization: FactorizationUsed,
    /// Numerical rank of the matrix.
    pub rank: usize,
    /// Estimate of 1/(‖K + αI‖₁‖(K + αI)⁻¹‖₁): about how many digits survive, as a fraction of all.
    #[serde(serialize_with = "finite")]
    pub reciprocal_condition: f64,
    /// ‖Y − (K + αI)Λ‖/‖Y‖ of the solve; for matrices and surfaces, with Y = 1.
    #[serde(serialize_with = "finite")]
    pub relative_residual: f64,
    /// ‖u‖² = ΛᵀKΛ in the native space of the kernel.
    #[serde(serialize_with = "finite")]
    pub native_norm_squared: f64,
    /// |u(X) − Y|, unit of the values.
    #[serde(serialize_with = "finite")]
    pub misfit: f64,
    /// Points that were merged into an earlier one.
    pub n_merged_duplicates: usize,
    /// What was changed or limits the accuracy.
    pub warnings: Vec<Warning>,
    /// The same for the fit of the surface, in answers about values on a surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, no_recursion)]
    pub geometry: Option<Box<Diagnostics>>,
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
    #[serde(serialize_with = "finite")]
    pub gradient_norm: f64,
}
