//! `GET /v1/kernels`: the kernel families, as a list for clients.

use serde::Serialize;
use strum::VariantArray;
use utoipa::ToSchema;

use crate::http::fields::KernelFamily;
use crate::http::openapi::responses::ReadProblems;
use gramian_host::wire::write::json::Json;
use gramian_numerics::kernel::{Family, WendlandSmoothness};

/// A parameter of a kernel family beside `length_scale` and `variance`.
#[derive(Serialize, ToSchema)]
pub struct KernelParameter {
    /// The name of the parameter in a kernel object.
    name: &'static str,
    /// The default.
    default: f64,
    /// The values that the parameter may take.
    range: &'static str,
}

/// A family of kernels.
#[derive(Serialize, ToSchema)]
pub struct KernelDescription {
    /// The name of the family in a kernel object.
    family: KernelFamily,
    /// φ as a function of r. The kernel is variance · φ(r).
    ///
    /// r = |x − y|/length_scale, or r² = Σ (x_c − y_c)²/length_scales_c².
    formula: &'static str,
    /// The smoothness of functions fitted with the kernel.
    smoothness: &'static str,
    /// Parameters beside `length_scale`, or `length_scales`, and `variance`.
    parameters: Vec<KernelParameter>,
    /// The largest dimension in which the kernel is positive definite. Absent if there is no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    max_dimension: Option<usize>,
    /// The condition under which the kernel has derivatives at the points of the cloud.
    ///
    /// Geometry and operators need derivatives there.
    differentiable_at_points: &'static str,
}

/// All kernel families.
#[derive(Serialize, ToSchema)]
pub struct KernelList {
    /// All families.
    kernels: Vec<KernelDescription>,
}

/// List kernels
///
/// Returns the kernel families with their formulas, parameters and smoothness.
#[utoipa::path(
    get,
    path = "/v1/kernels",
    tag = "values",
    responses((status = 200, description = "All families", body = KernelList), ReadProblems)
)]
pub async fn list_kernels() -> Json<KernelList> {
    Json(KernelList { kernels: KernelFamily::VARIANTS.iter().copied().map(KernelDescription::of).collect() })
}

impl KernelDescription {
    fn of(family: KernelFamily) -> Self {
        let always = "always";
        match family {
            KernelFamily::Gauss => Self {
                family,
                formula: "exp(-r^2), the RBF of scikit-learn with length_scale/sqrt(2)",
                smoothness: "analytic",
                parameters: vec![],
                max_dimension: None,
                differentiable_at_points: always,
            },
            KernelFamily::Laplace => Self {
                family,
                formula: "exp(-sqrt(r^2 + epsilon)), with phi(0) = exp(-sqrt(epsilon))",
                smoothness: "analytic if epsilon > 0, continuous with a kink if epsilon = 0",
                parameters: vec![KernelParameter { name: "epsilon", default: 0.0, range: "0 to 1e5" }],
                max_dimension: None,
                differentiable_at_points: "if epsilon > 0",
            },
            KernelFamily::Matern => Self {
                family,
                formula: "exp(-s) theta_p(s)/theta_p(0), s = sqrt(2 nu) r, nu = p + 1/2, theta_p the reverse Bessel polynomial",
                smoothness: "2p times continuously differentiable, p = nu - 1/2",
                parameters: vec![KernelParameter { name: "nu", default: 2.5, range: "0.5, 1.5, ..., 8.5" }],
                max_dimension: None,
                differentiable_at_points: "if nu >= 1.5",
            },
            KernelFamily::Wendland => Self {
                family,
                formula: "for r < 1, else 0: (1-r)^4 (4r+1); (1-r)^6 (35r^2+18r+3)/3; (1-r)^8 (32r^3+25r^2+8r+1)",
                smoothness: "2, 4 or 6 times continuously differentiable, as the parameter smoothness says",
                parameters: vec![KernelParameter { name: "smoothness", default: 4.0, range: "2, 4, 6" }],
                max_dimension: Family::Wendland { smoothness: WendlandSmoothness::C4 }.max_dimension(),
                differentiable_at_points: always,
            },
            KernelFamily::InverseMultiquadric => Self {
                family,
                formula: "(1 + r^2)^(-1/2)",
                smoothness: "analytic",
                parameters: vec![],
                max_dimension: None,
                differentiable_at_points: always,
            },
        }
    }
}
