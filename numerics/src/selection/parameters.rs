//! Hyperparameters, and which of them are free.

use crate::error::NumericsError;
use crate::kernel::{Family, Kernel};
use crate::points::cloud::Cloud;
use crate::sums::regularization::Regularization;

/// What a process is made of: `v φ(Σ_c (x_c − y_c)²/ℓ_c²)` and noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Hyperparameters {
    pub family: Family,
    /// ℓ, unit L: one, or one for each axis, `[d]`.
    pub length_scales: Vec<f64>,
    /// v, unit V².
    pub variance: f64,
    /// N, unit V².
    pub noise: Regularization,
}

impl Hyperparameters {
    /// Those of a kernel.
    pub fn of(kernel: &Kernel, noise: Regularization) -> Self {
        let length_scales = match kernel.length_scales() {
            Some(length_scales) => length_scales.to_vec(),
            None => vec![kernel.length_scale()],
        };
        Self { family: kernel.family(), length_scales, variance: kernel.variance(), noise }
    }

    /// The kernel on a cloud.
    ///
    /// # Errors
    /// [`NumericsError::InvalidKernelParameter`], [`NumericsError::InvalidLengthScale`], also for neither one nor d length scales;
    /// [`NumericsError::KernelNotPositiveDefinite`].
    pub fn kernel_on(&self, cloud: &Cloud) -> Result<Kernel, NumericsError> {
        let kernel = match self.length_scales[..] {
            [length_scale] => Kernel::new(self.family, length_scale, self.variance),
            ref length_scales => Kernel::of_axes(self.family, length_scales, self.variance),
        }?;
        kernel.check_dimension(cloud.dimension())?;
        Ok(kernel)
    }

    /// α, if every point has the same noise.
    pub(super) fn alpha(&self) -> Option<f64> {
        match self.noise {
            Regularization::Uniform(alpha) => Some(alpha),
            Regularization::PerPoint(_) => None,
        }
    }
}

/// What may be free.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Parameter {
    /// ℓ, one for all axes.
    LengthScale,
    /// ℓ_c of every axis: d free numbers.
    LengthScales,
    /// ℓ_c of one axis.
    LengthScaleOfAxis(usize),
    /// v.
    Variance,
    /// α, the same noise everywhere.
    Alpha,
    /// ε of the Laplace family; other families leave it alone.
    Epsilon,
}

impl Parameter {
    /// The least and the greatest number that bounds may be.
    pub fn range(self) -> (f64, f64) {
        match self {
            Self::Epsilon => (1e-300, 1e5),
            Self::Alpha => (1e-300, 1e300),
            Self::LengthScale | Self::LengthScales | Self::LengthScaleOfAxis(_) | Self::Variance => {
                (1e-140, 1e140)
            }
        }
    }
}

/// A parameter that is free between bounds, `0 < min ≤ max`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variation {
    pub parameter: Parameter,
    pub min: f64,
    pub max: f64,
}

/// A number this near to a bound is the bound: a logarithm and back is off by rounding.
const ROUNDING: f64 = 1e-12;

impl Variation {
    /// The number with this logarithm, within its bounds.
    pub(super) fn number(&self, logarithm: f64) -> f64 {
        match logarithm.exp() {
            number if number <= self.min * (1.0 + ROUNDING) => self.min,
            number if number >= self.max * (1.0 - ROUNDING) => self.max,
            number => number,
        }
    }

    /// What is wrong with the bounds.
    pub(super) fn check_bounds(&self) -> Result<(), &'static str> {
        let Self { parameter, min, max } = *self;
        let (least, greatest) = parameter.range();
        let requirement = match parameter {
            Parameter::Epsilon => "bounds must be between 1e-300 and 1e5",
            Parameter::Alpha => "bounds must be between 1e-300 and 1e300",
            _ => "bounds must be between 1e-140 and 1e140",
        };
        if !(least..=greatest).contains(&min) || !(least..=greatest).contains(&max) {
            return Err(requirement);
        }
        if min > max { Err("min must not be greater than max") } else { Ok(()) }
    }
}
