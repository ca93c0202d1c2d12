//! Hyperparameters of a process, and which of them a search may vary.

use crate::error::Result;
use crate::kernel::{Family, Kernel};
use crate::points::cloud::Cloud;
use crate::regression::sums::regularization::Regularization;

/// Hyperparameters of a process: the kernel `v φ(Σ_c (x_c − y_c)²/ℓ_c²)` and the noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Hyperparameters {
    pub family: Family,
    /// Length scales ℓ, unit L: one for all axes, or one for each axis, `[d]`.
    pub length_scales: Vec<f64>,
    /// Variance v, unit V².
    pub variance: f64,
    /// Noise variance N, unit V².
    pub noise: Regularization,
}

impl Hyperparameters {
    /// Returns the hyperparameters of a kernel with this noise.
    pub fn of(kernel: &Kernel, noise: Regularization) -> Self {
        let length_scales = match kernel.length_scales() {
            Some(length_scales) => length_scales.to_vec(),
            None => vec![kernel.length_scale()],
        };
        Self { family: kernel.family(), length_scales, variance: kernel.variance(), noise }
    }

    /// Returns the kernel on a cloud.
    ///
    /// # Errors
    /// `NumericsError::InvalidKernelParameter`, `NumericsError::KernelNotPositiveDefinite`.
    /// `NumericsError::InvalidLengthScale`, also for a number of length scales that is neither one nor d.
    pub fn kernel_on(&self, cloud: &Cloud) -> Result<Kernel> {
        let kernel = match self.length_scales[..] {
            [length_scale] => Kernel::new(self.family, length_scale, self.variance),
            ref length_scales => Kernel::of_axes(self.family, length_scales, self.variance),
        }?;
        kernel.check_dimension(cloud.dimension())?;
        Ok(kernel)
    }

    /// Returns α if every point has the same noise.
    pub(super) fn alpha(&self) -> Option<f64> {
        match self.noise {
            Regularization::Uniform(alpha) => Some(alpha),
            Regularization::PerPoint(_) => None,
        }
    }
}

/// A hyperparameter that a search may vary.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Parameter {
    /// ℓ, one number for all axes.
    LengthScale,
    /// ℓ_c of every axis: d free numbers.
    LengthScales,
    /// ℓ_c of one axis.
    LengthScaleOfAxis(usize),
    /// v.
    Variance,
    /// α, the same noise at every point.
    Alpha,
    /// ε of the Laplace family. Other families ignore it.
    Epsilon,
}

impl Parameter {
    /// Returns the least and the greatest number allowed as a bound.
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

/// Relative distance within which a number counts as its bound: exp(ln x) differs from x by rounding.
const ROUNDING: f64 = 1e-12;

impl Variation {
    /// Returns the number with this logarithm, moved into its bounds.
    pub(super) fn number(&self, logarithm: f64) -> f64 {
        match logarithm.exp() {
            number if number <= self.min * (1.0 + ROUNDING) => self.min,
            number if number >= self.max * (1.0 - ROUNDING) => self.max,
            number => number,
        }
    }

    /// Checks the bounds. The error states the requirement that they break.
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
