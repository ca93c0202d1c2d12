//! Gaussian process of a model, up to a factor.

use std::ops::RangeInclusive;

use crate::error::Result;
use crate::kernel::Kernel;
use crate::kernel::defaults::DEFAULT_ALPHA;
use crate::regression::selection::LearnedModel;
use crate::regression::sums::regularization::Regularization;

/// Ratios of noise to variance that lose no digit.
const RATIOS: RangeInclusive<f64> = 1e-280..=1e280;

/// Kernel and noise of a model, with the factor by which both are scaled afterwards, unit V².
///
/// A factor of K + αI depends only on the ratio of noise to variance. So a process is fitted with variance 1
/// where that is exact, and one factorization serves values of any size.
#[derive(Debug, Clone)]
pub struct ScaledProcess {
    pub kernel: Kernel,
    pub regularization: Regularization,
    pub scale: f64,
}

impl ScaledProcess {
    /// Returns the process with a given kernel. If no noise is given, α = 1e-10. Noise per point is never
    /// scaled.
    ///
    /// # Errors
    /// `NumericsError::InvalidRegularization`.
    pub fn of(kernel: Kernel, regularization: Option<Regularization>) -> Result<Self> {
        let variance = kernel.variance();
        match given_or(regularization, DEFAULT_ALPHA)? {
            Regularization::Uniform(alpha) if alpha == 0.0 || RATIOS.contains(&(alpha / variance)) => {
                let regularization = Regularization::uniform(alpha / variance)?;
                Ok(Self { kernel: kernel.of_variance_one(), regularization, scale: variance })
            }
            regularization => Ok(Self { kernel, regularization, scale: 1.0 }),
        }
    }

    /// Returns the process with a kernel learned from values, and with learned noise where none is given.
    ///
    /// # Errors
    /// `NumericsError::InvalidKernelParameter`, `NumericsError::InvalidRegularization`.
    pub fn learned(learned: &LearnedModel, given: Option<Regularization>) -> Result<Self> {
        let LearnedModel { ratio, variance, .. } = *learned;
        match given_or(given, ratio * variance)? {
            // A learned variance may leave the range of kernels, so it becomes the scale of a kernel of
            // variance 1.
            Regularization::Uniform(alpha) => {
                let regularization = Regularization::uniform(alpha / variance)?;
                Ok(Self { kernel: learned.kernel(1.0)?, regularization, scale: variance })
            }
            regularization => Ok(Self { kernel: learned.kernel(variance)?, regularization, scale: 1.0 }),
        }
    }

    /// Returns the process with a kernel of variance 1 from a rule, and with `alpha` of that rule if no noise
    /// is given.
    ///
    /// # Errors
    /// `NumericsError::InvalidRegularization`.
    pub fn by_rule(kernel: Kernel, alpha: f64, given: Option<Regularization>) -> Result<Self> {
        Ok(Self { kernel, regularization: given_or(given, alpha)?, scale: 1.0 })
    }
}

fn given_or(given: Option<Regularization>, alpha: f64) -> Result<Regularization> {
    given.map_or_else(|| Regularization::uniform(alpha), Ok)
}
