//! What is added to the diagonal of the Gram matrix.

use crate::error::NumericsError;
use crate::points::cloud::Cloud;

/// α, added to the diagonal of the (variance-scaled) Gram matrix exactly as given; unit V².
///
/// 0 interpolates. Under the Gaussian-process reading it is the variance of the observation noise, which may differ from
/// point to point.
#[derive(Debug, Clone, PartialEq)]
pub enum Regularization {
    Uniform(f64),
    /// One entry per point.
    PerPoint(Vec<f64>),
}

impl Regularization {
    /// # Errors
    /// [`NumericsError::InvalidRegularization`] if α is negative or not finite.
    pub fn uniform(alpha: f64) -> Result<Self, NumericsError> {
        check("alpha", alpha, None)?;
        Ok(Self::Uniform(alpha))
    }

    /// # Errors
    /// [`NumericsError::InvalidRegularization`] with the first point whose variance is negative or not finite.
    pub fn per_point(variances: Vec<f64>) -> Result<Self, NumericsError> {
        for (point, &variance) in variances.iter().enumerate() {
            check("noise variance", variance, Some(point))?;
        }
        Ok(Self::PerPoint(variances))
    }

    /// # Errors
    /// [`NumericsError::LengthMismatch`] if there is an entry per point, but not of this cloud.
    pub fn check_matches(&self, cloud: &Cloud) -> Result<(), NumericsError> {
        match self {
            Self::Uniform(_) => Ok(()),
            Self::PerPoint(variances) => cloud.check_one_per_point(variances),
        }
    }

    /// The entry of one point.
    pub fn at(&self, point: usize) -> f64 {
        match self {
            Self::Uniform(alpha) => *alpha,
            Self::PerPoint(variances) => variances[point],
        }
    }
}

/// Up to 1e300, so that adding it to a kernel value stays finite.
fn check(parameter: &'static str, value: f64, point: Option<usize>) -> Result<(), NumericsError> {
    if (0.0..=1e300).contains(&value) {
        Ok(())
    } else {
        let requirement = "must be between 0 and 1e300";
        Err(NumericsError::InvalidRegularization { parameter, requirement, point })
    }
}
