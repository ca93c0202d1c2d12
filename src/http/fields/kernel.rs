//! Kernels in JSON, and their conversion to and from kernels of the numerics.

use serde::{Deserialize, Serialize};
use strum::VariantArray;
use utoipa::ToSchema;

use super::schemas::Smoothness;
use crate::http::problem::{Pointers, Problem, from_numerics};
use gramian_host::json_members;
use gramian_host::wire::read::members::present_unless_empty;
use gramian_numerics::kernel::defaults::Purpose;
use gramian_numerics::kernel::{Family, Kernel as NumericalKernel, WendlandSmoothness};
use gramian_numerics::patches::PatchKernel;
use gramian_numerics::points::sampling::Scales;

/// The families of kernels. `GET /v1/kernels` has their formulas.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema, VariantArray)]
#[serde(rename_all = "snake_case")]
pub enum KernelFamily {
    Gauss,
    Laplace,
    Matern,
    Wendland,
    InverseMultiquadric,
}

impl From<Family> for KernelFamily {
    fn from(family: Family) -> Self {
        match family {
            Family::Gauss => Self::Gauss,
            Family::Laplace { .. } => Self::Laplace,
            Family::Matern { .. } => Self::Matern,
            Family::Wendland { .. } => Self::Wendland,
            Family::InverseMultiquadric => Self::InverseMultiquadric,
        }
    }
}

/// The smoothness ν = p + ½ of the Matérn kernel of order p.
pub fn nu_of(order: u8) -> f64 {
    f64::from(order) + 0.5
}

/// A kernel `k(x, y) = variance · φ(r²)`.
///
/// Here `r = |x − y|/length_scale`, or `r² = Σ (x_c − y_c)²/length_scales_c²`. A parameter of another family
/// is refused.
#[derive(Debug, Clone, PartialEq, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Kernel {
    /// The family, which determines φ.
    pub family: KernelFamily,
    /// The length scale ℓ, in the unit of the coordinates. Default: chosen from the cloud.
    #[schema(exclusive_minimum = 0.0)]
    pub length_scale: Option<f64>,
    /// A length scale per axis, in the units of the coordinates, instead of `length_scale`. An empty list
    /// counts as absent.
    #[serde(default, deserialize_with = "present_unless_empty")]
    pub length_scales: Option<Vec<f64>>,
    /// The factor of φ, unit of the values squared. Default: 1.
    #[schema(exclusive_minimum = 0.0)]
    pub variance: Option<f64>,
    /// laplace: φ = exp(−√(r² + epsilon)). Default: 0, which leaves a kink at the points of the cloud.
    #[schema(minimum = 0.0)]
    pub epsilon: Option<f64>,
    /// matern: the smoothness ν, one of 0.5, 1.5, …, 8.5. Default: 2.5.
    ///
    /// The schema gives a range, because generators do not support enumerations of fractions.
    #[schema(minimum = 0.5, maximum = 8.5, multiple_of = 0.5)]
    pub nu: Option<f64>,
    /// wendland: 2, 4 or 6 times differentiable. Default: 4.
    #[schema(value_type = Option<Smoothness>)]
    pub smoothness: Option<u8>,
}

/// The kernel that was used, with every number. Sent back as `kernel`, it gives the same answer.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct KernelUsed {
    /// The family, which determines φ.
    pub family: KernelFamily,
    /// The length scale ℓ, in the unit of the coordinates. Absent if each axis has its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_scale: Option<f64>,
    /// The length scale of each axis, if each has its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_scales: Option<Vec<f64>>,
    /// The factor of φ, unit of the values squared.
    pub variance: f64,
    /// laplace: φ = exp(−√(r² + epsilon)).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub epsilon: Option<f64>,
    /// matern: the smoothness ν.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nu: Option<f64>,
    /// wendland: how many times the kernel is differentiable.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Smoothness>)]
    pub smoothness: Option<u8>,
}

/// A checked kernel. Its length scale may still have to be chosen from the cloud.
#[derive(Debug, Clone)]
pub enum PlannedKernel {
    Given(NumericalKernel),
    OfCloud { family: Family, variance: f64 },
}

impl PlannedKernel {
    /// Chooses the length scale, if it was not given.
    ///
    /// # Errors
    /// 422 if the extent of the cloud is too small or too large for any length scale.
    pub fn resolve(
        &self,
        scales: Option<&Scales>,
        purpose: Purpose,
        pointers: Pointers,
    ) -> Result<NumericalKernel, Problem> {
        match self {
            Self::Given(kernel) => Ok(kernel.clone()),
            &Self::OfCloud { family, variance } => {
                let scales = scales.ok_or_else(Problem::internal)?;
                let length_scale = match purpose {
                    Purpose::Values => family.length_scale_of_values(scales),
                    Purpose::Normals | Purpose::Curvatures | Purpose::LevelSets => {
                        family.default_length_scale(scales)
                    }
                };
                NumericalKernel::new(family, length_scale, variance)
                    .map_err(|error| from_numerics(error, pointers))
            }
        }
    }
}

impl Kernel {
    /// Checks the given parameters.
    ///
    /// # Errors
    /// 422 with a pointer to the parameter.
    pub fn plan(&self, pointers: Pointers) -> Result<PlannedKernel, Problem> {
        let family = self.resolve_family(pointers)?;
        let variance = self.variance.unwrap_or(1.0);
        let kernel = match (self.length_scale, &self.length_scales) {
            (Some(_), Some(_)) => {
                let detail = "length_scale and length_scales exclude each other";
                return Err(Problem::invalid_request(format!("{}/length_scales", pointers.kernel), detail));
            }
            (None, Some(length_scales)) => NumericalKernel::of_axes(family, length_scales, variance),
            // Without a length scale, an arbitrary one serves to check the other parameters.
            (length_scale, None) => NumericalKernel::new(family, length_scale.unwrap_or(1.0), variance),
        };
        let kernel = kernel.map_err(|error| from_numerics(error, pointers))?;
        Ok(match (self.length_scale, &self.length_scales) {
            (None, None) => PlannedKernel::OfCloud { family, variance },
            _ => PlannedKernel::Given(kernel),
        })
    }

    fn resolve_family(&self, pointers: Pointers) -> Result<Family, Problem> {
        let of_others = [
            ("epsilon", KernelFamily::Laplace, self.epsilon.is_some()),
            ("nu", KernelFamily::Matern, self.nu.is_some()),
            ("smoothness", KernelFamily::Wendland, self.smoothness.is_some()),
        ];
        for (name, owner, is_given) in of_others {
            if is_given && self.family != owner {
                let detail = format!("{name} is a parameter of another family");
                return Err(Problem::invalid_request(format!("{}/{name}", pointers.kernel), detail));
            }
        }
        match self.family {
            KernelFamily::Gauss => Ok(Family::Gauss),
            KernelFamily::Laplace => Ok(Family::Laplace { epsilon: self.epsilon.unwrap_or(0.0) }),
            KernelFamily::InverseMultiquadric => Ok(Family::InverseMultiquadric),
            KernelFamily::Matern => {
                let nu = self.nu.unwrap_or(2.5);
                let order = nu - 0.5;
                if (0.0..=8.0).contains(&order) && order.fract() == 0.0 {
                    return Ok(Family::Matern { order: order as u8 });
                }
                let detail = format!("nu must be one of 0.5, 1.5, ..., 8.5, found {nu}");
                Err(Problem::invalid_request(format!("{}/nu", pointers.kernel), detail))
            }
            KernelFamily::Wendland => {
                let smoothness = match self.smoothness.unwrap_or(4) {
                    2 => WendlandSmoothness::C2,
                    4 => WendlandSmoothness::C4,
                    6 => WendlandSmoothness::C6,
                    other => {
                        let detail = format!("smoothness must be 2, 4 or 6, found {other}");
                        return Err(Problem::invalid_request(
                            format!("{}/smoothness", pointers.kernel),
                            detail,
                        ));
                    }
                };
                Ok(Family::Wendland { smoothness })
            }
        }
    }
}

json_members!(KernelUsed);

impl KernelUsed {
    /// The kernel of the heights of local regressions: Matérn with ν = 9/2.
    pub fn heights(kernel: PatchKernel) -> Self {
        let PatchKernel { length_scale, variance } = kernel;
        Self {
            family: KernelFamily::Matern,
            length_scale: Some(length_scale),
            length_scales: None,
            variance,
            epsilon: None,
            nu: Some(4.5),
            smoothness: None,
        }
    }

    /// A kernel whose variance is multiplied by a factor.
    pub fn scaled(kernel: &NumericalKernel, factor: f64) -> Self {
        let used = Self::from(kernel);
        Self { variance: used.variance * factor, ..used }
    }
}

impl From<&NumericalKernel> for KernelUsed {
    /// Reports every number used, so that a client can pin them.
    fn from(kernel: &NumericalKernel) -> Self {
        let mut full = Self {
            family: kernel.family().into(),
            length_scale: Some(kernel.length_scale()).filter(|_| !kernel.is_stretched()),
            length_scales: kernel.length_scales().map(<[f64]>::to_vec),
            variance: kernel.variance(),
            epsilon: None,
            nu: None,
            smoothness: None,
        };
        match kernel.family() {
            Family::Gauss | Family::InverseMultiquadric => {}
            Family::Laplace { epsilon } => full.epsilon = Some(epsilon),
            Family::Matern { order } => full.nu = Some(nu_of(order)),
            Family::Wendland { smoothness } => {
                full.smoothness = Some(match smoothness {
                    WendlandSmoothness::C2 => 2,
                    WendlandSmoothness::C4 => 4,
                    WendlandSmoothness::C6 => 6,
                });
            }
        }
        full
    }
}
