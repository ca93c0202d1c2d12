//! The regularization α, added to the diagonal of the Gram matrix.

use crate::error::{NumericsError, Result};
use crate::points::cloud::Cloud;

/// The regularization α, unit V², added to the diagonal of the (variance-scaled) Gram matrix as given.
///
/// With α = 0 the fit interpolates. Under the Gaussian-process reading α is the variance of the observation
/// noise, which may differ from point to point.
#[derive(Debug, Clone, PartialEq)]
pub enum Regularization {
    Uniform(f64),
    /// An α for each point, `[n]`.
    PerPoint(Vec<f64>),
}

impl Regularization {
    /// Returns one α for all points.
    ///
    /// # Errors
    /// [`NumericsError::InvalidRegularization`] if α is negative, not finite or above 1e300.
    pub fn uniform(alpha: f64) -> Result<Self> {
        check("alpha", alpha, None)?;
        Ok(Self::Uniform(alpha))
    }

    /// Returns a regularization with one noise variance per point.
    ///
    /// # Errors
    /// [`NumericsError::InvalidRegularization`] with the first point whose variance is negative, not finite
    /// or above 1e300.
    pub fn per_point(variances: Vec<f64>) -> Result<Self> {
        for (point, &variance) in variances.iter().enumerate() {
            check("noise variance", variance, Some(point))?;
        }
        Ok(Self::PerPoint(variances))
    }

    /// Checks that a regularization per point has one entry for each point of the cloud.
    ///
    /// # Errors
    /// [`NumericsError::LengthMismatch`] if the number of entries differs.
    pub(crate) fn check_matches(&self, cloud: &Cloud) -> Result<()> {
        match self {
            Self::Uniform(_) => Ok(()),
            Self::PerPoint(variances) => cloud.check_one_per_point(variances),
        }
    }

    /// Returns the α of one point.
    pub fn at(&self, point: usize) -> f64 {
        match self {
            Self::Uniform(alpha) => *alpha,
            Self::PerPoint(variances) => variances[point],
        }
    }
}

/// Checks that a value lies between 0 and 1e300, so that adding it to a kernel value stays finite.
fn check(parameter: &'static str, value: f64, point: Option<usize>) -> Result<()> {
    if (0.0..=1e300).contains(&value) {
        Ok(())
    } else {
        let requirement = "must be between 0 and 1e300";
        Err(NumericsError::InvalidRegularization { parameter, requirement, point })
    }
}
