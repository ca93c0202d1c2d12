//! A function as a sum of kernels over centres.

use super::jets::{JetOrder, Jets};
use super::symmetric::kernel_times;
use crate::error::Result;
use crate::kernel::Kernel;
use crate::observer::Observer;
use crate::points::cloud::Cloud;

/// A function `u(x) = Σ_j λ_j k(x, z_j)` with r centres z.
///
/// The centres are all points of a system, or those to which its solver gives weights.
#[derive(Clone, Copy)]
pub(crate) struct Expansion<'a> {
    /// The centres z, `[r, d]`.
    pub centres: &'a Cloud,
    pub kernel: &'a Kernel,
    /// λ, `[r]`, in the unit of the values over that of the kernel.
    pub weights: &'a [f64],
}

impl Expansion<'_> {
    /// Evaluates u and its derivatives at queries `[m, d]`. The caller makes sure that the kernel has these
    /// derivatives there.
    ///
    /// # Errors
    /// Returns the errors of [`Jets::evaluate`].
    pub fn at(self, queries: &Cloud, order: JetOrder, observer: &dyn Observer) -> Result<Jets> {
        if std::ptr::eq(queries, self.centres) && order == JetOrder::Hessian {
            Jets::at_points(self.centres, self.kernel, self.weights, observer)
        } else {
            Jets::evaluate(self.centres, self.kernel, self.weights, queries, order, observer)
        }
    }

    /// Evaluates u alone at queries, `[m]`. If they are the centres themselves, each pair is evaluated only
    /// once.
    ///
    /// # Errors
    /// Returns the errors of [`Jets::evaluate`].
    pub(crate) fn values_at(self, queries: &Cloud, observer: &dyn Observer) -> Result<Vec<f64>> {
        if std::ptr::eq(queries, self.centres) {
            kernel_times(self.centres, self.kernel, self.weights, observer)
        } else {
            Ok(self.at(queries, JetOrder::Value, observer)?.values())
        }
    }
}
