//! Hyperparameters, which of them are free, and the box of their logarithms that is searched.

use super::contraction::Sums;
use crate::numerics::error::NumericsError;
use crate::numerics::kernel::{Family, Kernel};
use crate::numerics::points::cloud::Cloud;
use crate::numerics::sums::regularization::Regularization;

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
        let length_scales = vec![kernel.length_scale()];
        Self { family: kernel.family(), length_scales, variance: kernel.variance(), noise }
    }

    /// The cloud and the kernel that have these covariances: with a length scale for each axis, the cloud in units of them and ℓ = 1.
    ///
    /// # Errors
    /// [`NumericsError::InvalidKernelParameter`]; [`NumericsError::KernelNotPositiveDefinite`]; [`NumericsError::DimensionMismatch`] for neither one
    /// nor d length scales; [`NumericsError::CoordinateTooLarge`] in units that are too small.
    pub fn stretched(&self, cloud: &Cloud) -> Result<(Cloud, Kernel), NumericsError> {
        let d = cloud.dimension();
        let (stretched, length_scale) = match self.length_scales[..] {
            [length_scale] => (cloud.clone(), length_scale),
            ref scales if scales.len() == d => {
                for &scale in scales {
                    Kernel::new(self.family, scale, self.variance)?;
                }
                let scaled =
                    cloud.coordinates().iter().zip(scales.iter().cycle()).map(|(x, scale)| x / scale);
                (Cloud::new(scaled.collect(), d)?, 1.0)
            }
            ref scales => {
                return Err(NumericsError::DimensionMismatch { expected: d, found: scales.len() });
            }
        };
        let kernel = Kernel::new(self.family, length_scale, self.variance)?;
        kernel.check_dimension(d)?;
        Ok((stretched, kernel))
    }

    fn alpha(&self) -> Option<f64> {
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
    fn number(&self, logarithm: f64) -> f64 {
        match logarithm.exp() {
            number if number <= self.min * (1.0 + ROUNDING) => self.min,
            number if number >= self.max * (1.0 - ROUNDING) => self.max,
            number => number,
        }
    }
}

/// The hyperparameters in a box of the logarithms of those that are free.
#[derive(Debug, Clone)]
pub(super) struct Space {
    base: Hyperparameters,
    /// One entry for each free number.
    free: Vec<Variation>,
}

impl Space {
    /// The free numbers of hyperparameters, which are moved into their bounds.
    ///
    /// # Errors
    /// [`NumericsError::InvalidVariation`].
    pub(super) fn of(
        base: &Hyperparameters,
        vary: &[Variation],
        dimension: usize,
    ) -> Result<Self, NumericsError> {
        let mut space = Self { base: base.clone(), free: Vec::new() };
        for (entry, &variation) in vary.iter().enumerate() {
            let refuse = |requirement| NumericsError::InvalidVariation { entry, requirement };
            check_bounds(&variation).map_err(refuse)?;
            let Variation { parameter, min, max } = variation;
            let axes = match parameter {
                Parameter::LengthScales => 0..dimension,
                Parameter::LengthScaleOfAxis(axis) if axis >= dimension => {
                    return Err(refuse("must name an axis of the cloud"));
                }
                Parameter::LengthScaleOfAxis(axis) => axis..axis + 1,
                _ => 0..0,
            };
            if !axes.is_empty() && space.base.length_scales.len() == 1 {
                space.base.length_scales = vec![space.base.length_scales[0]; dimension];
            }
            let single = axes.is_empty().then_some(parameter);
            let of_axes = axes.map(Parameter::LengthScaleOfAxis);
            for parameter in single.into_iter().chain(of_axes) {
                space.free.push(Variation { parameter, min, max });
            }
        }
        space.check_distinct(vary)?;
        space.base = space.at(&space.start());
        Ok(space)
    }

    /// Whether nothing is free twice, and α is one number.
    fn check_distinct(&self, vary: &[Variation]) -> Result<(), NumericsError> {
        let last = vary.len().saturating_sub(1);
        for (at, free) in self.free.iter().enumerate() {
            let entry = vary.iter().rposition(|v| v.parameter == free.parameter).unwrap_or(last);
            let refuse = |requirement| Err(NumericsError::InvalidVariation { entry, requirement });
            if self.free[..at].iter().any(|other| other.parameter == free.parameter) {
                return refuse("must not vary a parameter twice");
            }
            match free.parameter {
                Parameter::LengthScale if self.base.length_scales.len() > 1 => {
                    return refuse("cannot vary one length scale where every axis has its own");
                }
                Parameter::Alpha if self.base.alpha().is_none() => {
                    return refuse("cannot vary alpha where every point has its own noise");
                }
                _ => {}
            }
        }
        Ok(())
    }

    pub(super) fn n_free(&self) -> usize {
        self.free.len()
    }

    /// What each free number belongs to.
    pub(super) fn parameters(&self) -> impl Iterator<Item = Parameter> + '_ {
        self.free.iter().map(|free| free.parameter)
    }

    /// Whether slopes along single axes are wanted.
    pub(super) fn per_axis(&self) -> bool {
        self.free.iter().any(|free| matches!(free.parameter, Parameter::LengthScaleOfAxis(_)))
    }

    /// The bounds of the logarithms.
    pub(super) fn bounds(&self) -> Vec<(f64, f64)> {
        self.free.iter().map(|free| (free.min.ln(), free.max.ln())).collect()
    }

    /// Where the search begins.
    pub(super) fn start(&self) -> Vec<f64> {
        self.numbers_of(&self.base)
    }

    /// The hyperparameters with these logarithms.
    pub(super) fn at(&self, logarithms: &[f64]) -> Hyperparameters {
        let mut found = self.base.clone();
        for (free, logarithm) in self.free.iter().zip(logarithms) {
            let number = free.number(*logarithm);
            match free.parameter {
                Parameter::LengthScale => found.length_scales = vec![number],
                Parameter::LengthScales => found.length_scales.fill(number),
                Parameter::LengthScaleOfAxis(axis) => found.length_scales[axis] = number,
                Parameter::Variance => found.variance = number,
                Parameter::Alpha => found.noise = Regularization::Uniform(number),
                Parameter::Epsilon => {
                    if let Family::Laplace { epsilon } = &mut found.family {
                        *epsilon = number;
                    }
                }
            }
        }
        found
    }

    /// Derivatives in the logarithms, from sums over pairs and the trace of their weights.
    pub(super) fn gradient(&self, at: &Hyperparameters, sums: &Sums, trace: f64) -> Vec<f64> {
        let v = at.variance;
        let slope = |free: &Variation| match free.parameter {
            Parameter::LengthScale | Parameter::LengthScales => -2.0 * v * sums.of_scaled_slopes,
            Parameter::LengthScaleOfAxis(axis) => -2.0 * v * sums.of_axes[axis],
            Parameter::Variance => v * sums.of_values,
            Parameter::Alpha => at.alpha().unwrap_or(0.0) * trace,
            Parameter::Epsilon => match at.family {
                Family::Laplace { epsilon } => v * epsilon * sums.of_slopes,
                _ => 0.0,
            },
        };
        self.free.iter().map(slope).collect()
    }

    fn numbers_of(&self, of: &Hyperparameters) -> Vec<f64> {
        let number = |free: &Variation| match free.parameter {
            Parameter::LengthScale | Parameter::LengthScales => of.length_scales[0],
            Parameter::LengthScaleOfAxis(axis) => of.length_scales[axis],
            Parameter::Variance => of.variance,
            Parameter::Alpha => of.alpha().unwrap_or(free.min),
            Parameter::Epsilon => match of.family {
                Family::Laplace { epsilon } => epsilon,
                _ => free.min,
            },
        };
        // Bounds are positive, so that a 0 gets a logarithm.
        self.free.iter().map(|free| number(free).clamp(free.min, free.max).ln()).collect()
    }
}

/// What is wrong with the bounds.
fn check_bounds(variation: &Variation) -> Result<(), &'static str> {
    let Variation { parameter, min, max } = *variation;
    let (least, greatest, requirement) = match parameter {
        Parameter::Epsilon => (1e-300, 1e5, "bounds must be between 1e-300 and 1e5"),
        Parameter::Alpha => (1e-300, 1e300, "bounds must be between 1e-300 and 1e300"),
        _ => (1e-140, 1e140, "bounds must be between 1e-140 and 1e140"),
    };
    if !(least..=greatest).contains(&min) || !(least..=greatest).contains(&max) {
        return Err(requirement);
    }
    if min > max { Err("min must not be greater than max") } else { Ok(()) }
}
