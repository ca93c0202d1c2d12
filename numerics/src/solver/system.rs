//! `K(X, X) + αI`, not yet solved.

use std::sync::Arc;

use crate::error::NumericsError;
use crate::kernel::Kernel;
use crate::machine::heap::{arc_payload, block_bytes, vec_bytes};
use crate::points::cloud::Cloud;
use crate::points::duplicates::coinciding_points;
use crate::sums::regularization::Regularization;

/// The linear system of a fit, `(K(X, X) + αI) Λ = Y` for any values Y. That it can have a solution is checked.
#[derive(Clone)]
pub struct System {
    cloud: Arc<Cloud>,
    kernel: Kernel,
    regularization: Regularization,
}

impl System {
    /// # Errors
    /// [`NumericsError::KernelNotPositiveDefinite`] in this dimension, [`NumericsError::LengthMismatch`] of noise
    /// variances, [`NumericsError::DuplicatePoints`] where two coinciding points have no regularization.
    pub fn new(
        cloud: Arc<Cloud>,
        kernel: Kernel,
        regularization: Regularization,
    ) -> Result<Self, NumericsError> {
        kernel.check_dimension(cloud.dimension())?;
        regularization.check_matches(&cloud)?;
        let twins = coinciding_points(&cloud, |point| regularization.at(point) == 0.0);
        if !twins.is_empty() {
            return Err(NumericsError::DuplicatePoints { points: twins });
        }
        Ok(Self { cloud, kernel, regularization })
    }

    /// X.
    pub fn cloud(&self) -> &Arc<Cloud> {
        &self.cloud
    }

    pub fn kernel(&self) -> &Kernel {
        &self.kernel
    }

    /// α.
    pub fn regularization(&self) -> &Regularization {
        &self.regularization
    }

    pub fn n_points(&self) -> usize {
        self.cloud.n_points()
    }

    /// Bytes held on the heap, those of the cloud included: the system may outlive whoever shares it.
    pub(crate) fn n_bytes(&self) -> usize {
        let noise = match &self.regularization {
            Regularization::Uniform(_) => 0,
            Regularization::PerPoint(variances) => vec_bytes(variances),
        };
        noise + block_bytes(arc_payload::<Cloud>()) + self.cloud.n_bytes() + self.kernel.n_bytes()
    }
}
