//! A function as a sum over centres.

use super::jets::{JetOrder, Jets};
use super::symmetric::kernel_times;
use crate::error::NumericsError;
use crate::kernel::Kernel;
use crate::observer::Observer;
use crate::points::cloud::Cloud;

/// `u(x) = Σ_j λ_j k(x, z_j)`: the centres z are all points of a system, or those that its solver gives weights.
#[derive(Clone, Copy)]
pub struct Expansion<'a> {
    /// `[r, d]`
    pub centres: &'a Cloud,
    pub kernel: &'a Kernel,
    /// λ, `[r]`, unit of the values over that of the kernel.
    pub weights: &'a [f64],
}

impl Expansion<'_> {
    /// u and its derivatives at queries `[m, d]`; whether the kernel has them there is for the caller to know.
    ///
    /// # Errors
    /// Those of [`Jets::evaluate`].
    pub fn at(
        self,
        queries: &Cloud,
        order: JetOrder,
        observer: &dyn Observer,
    ) -> Result<Jets, NumericsError> {
        match std::ptr::eq(queries, self.centres) && order == JetOrder::Hessian {
            true => Jets::at_points(self.centres, self.kernel, self.weights, observer),
            false => Jets::evaluate(self.centres, self.kernel, self.weights, queries, order, observer),
        }
    }

    /// u at queries alone, `[m]`; where they are the centres themselves, by half of the pairs.
    ///
    /// # Errors
    /// Those of [`Jets::evaluate`].
    pub(crate) fn values_at(
        self,
        queries: &Cloud,
        observer: &dyn Observer,
    ) -> Result<Vec<f64>, NumericsError> {
        match std::ptr::eq(queries, self.centres) {
            true => kernel_times(self.centres, self.kernel, self.weights, observer),
            false => Ok(self.at(queries, JetOrder::Value, observer)?.values()),
        }
    }
}
