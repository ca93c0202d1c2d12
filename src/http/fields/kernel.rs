//! Kernels of requests to kernels of the numerics, and back into the diagnostics.

use crate::http::fields::{Kernel, KernelFamily, KernelUsed};
use crate::http::problem::{Place, Problem};
use crate::numerics::kernel::{Family, Kernel as NumericalKernel, WendlandSmoothness};
use crate::numerics::points::sampling::Scales;

/// A kernel that is checked but for a length scale that the cloud has yet to give.
#[derive(Debug, Clone, Copy)]
pub enum PlannedKernel {
    Given(NumericalKernel),
    OfCloud { family: Family, variance: f64 },
}

impl PlannedKernel {
    /// Fills in the length scale.
    ///
    /// # Errors
    /// 422 if the cloud is too small or large for any.
    pub fn resolve(&self, scales: Option<&Scales>, place: Place) -> Result<NumericalKernel, Problem> {
        match *self {
            Self::Given(kernel) => Ok(kernel),
            Self::OfCloud { family, variance } => {
                let scales = scales.ok_or_else(Problem::internal)?;
                NumericalKernel::new(family, family.default_length_scale(scales), variance)
                    .map_err(|error| Problem::from_numerics(error, place))
            }
        }
    }
}

impl Kernel {
    /// Checks what is given.
    ///
    /// # Errors
    /// 422 with a pointer to the parameter.
    pub fn plan(&self, place: Place) -> Result<PlannedKernel, Problem> {
        let family = self.resolve_family(place)?;
        let variance = self.variance.unwrap_or(1.0);
        // Without a length scale the other parameters are checked with any.
        let kernel = NumericalKernel::new(family, self.length_scale.unwrap_or(1.0), variance)
            .map_err(|error| Problem::from_numerics(error, place))?;
        Ok(match self.length_scale {
            Some(_) => PlannedKernel::Given(kernel),
            None => PlannedKernel::OfCloud { family, variance },
        })
    }

    fn resolve_family(&self, place: Place) -> Result<Family, Problem> {
        let of_others = [
            ("epsilon", KernelFamily::Laplace, self.epsilon.is_some()),
            ("nu", KernelFamily::Matern, self.nu.is_some()),
            ("smoothness", KernelFamily::Wendland, self.smoothness.is_some()),
        ];
        for (name, owner, is_given) in of_others {
            if is_given && self.family != owner {
                let detail = format!("{name} is a parameter of another family");
                return Err(Problem::invalid_request(format!("{}/{name}", place.kernel), detail));
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
                Err(Problem::invalid_request(format!("{}/nu", place.kernel), detail))
            }
            KernelFamily::Wendland => {
                let smoothness = match self.smoothness.unwrap_or(4) {
                    2 => WendlandSmoothness::C2,
                    4 => WendlandSmoothness::C4,
                    6 => WendlandSmoothness::C6,
                    other => {
                        let detail = format!("smoothness must be 2, 4 or 6, found {other}");
                        return Err(Problem::invalid_request(format!("{}/smoothness", place.kernel), detail));
                    }
                };
                Ok(Family::Wendland { smoothness })
            }
        }
    }
}

impl From<&NumericalKernel> for KernelUsed {
    /// Every number used, so that a client can pin them.
    fn from(kernel: &NumericalKernel) -> Self {
        let mut full = Self {
            family: KernelFamily::Gauss,
            length_scale: kernel.length_scale(),
            variance: kernel.variance(),
            epsilon: None,
            nu: None,
            smoothness: None,
        };
        match kernel.family() {
            Family::Gauss => full.family = KernelFamily::Gauss,
            Family::InverseMultiquadric => full.family = KernelFamily::InverseMultiquadric,
            Family::Laplace { epsilon } => {
                full.family = KernelFamily::Laplace;
                full.epsilon = Some(epsilon);
            }
            Family::Matern { order } => {
                full.family = KernelFamily::Matern;
                full.nu = Some(f64::from(order) + 0.5);
            }
            Family::Wendland { smoothness } => {
                full.family = KernelFamily::Wendland;
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
