//! The outward side of a surface, from the signature function of a subset of its points.

use std::sync::Arc;

use super::runs::Runs;
use crate::error::NumericsError;
use crate::kernel::Kernel;
use crate::kernel::defaults::{Purpose, default_fit};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::duplicates::Merge;
use crate::points::sampling::Sampling;
use crate::points::thinning::{n_coarse, thinned_points};
use crate::regression::function::interpolant::Interpolant;
use crate::regression::solver::{Solver, System};
use crate::regression::sums::jets::JetOrder;
use crate::regression::sums::regularization::Regularization;

/// Distance over which gradients of the signature function are continued, in spacings of the coarse cloud.
/// The kernel bends over three of them.
const REACH: f64 = 0.3;

/// Points of a run from which continuing is worth while: second derivatives take about twice the time.
const WORTH_CONTINUING: usize = 3;

/// A thinned cloud with kernel and α. Its signature function tells which side of the full surface is outward.
pub struct CoarseCloud {
    /// The points, ascending. No two coincide.
    pub points: Vec<usize>,
    pub kernel: Kernel,
    /// α: added to the diagonal of the kernel's matrix.
    pub alpha: f64,
    cloud: Cloud,
    /// Spacing of the coarse cloud, unit L.
    spacing: f64,
}

impl CoarseCloud {
    /// Selects `count` points, spread as the cloud is. By default n/6, at least 600 and at most 6,000 (all
    /// points of smaller clouds). Duplicates are merged, so fewer may remain. `noise` is the standard
    /// deviation of the points across the surface, unit L.
    ///
    /// # Errors
    /// Returns [`NumericsError::Cancelled`].
    pub fn of(
        cloud: &Cloud,
        count: Option<usize>,
        noise: f64,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        let count = count.unwrap_or_else(|| n_coarse(cloud.n_points()));
        let mut points = thinned_points(cloud, count, observer)?;
        let mut coarse = cloud.select(&points);
        if let Some((merged, merge)) = Merge::duplicates_of(&coarse, observer)? {
            points = (0..merged.n_points()).map(|group| points[merge.first_point(group)]).collect();
            coarse = merged;
        }
        let sampling = Sampling::of(&coarse, observer)?;
        // The closure is called only if the purpose needs the noise.
        let (kernel, alpha) = default_fit(sampling.scales(), Purpose::Normals, || noise)?;
        Ok(Self { points, kernel, alpha, cloud: coarse, spacing: sampling.scales().spacing })
    }

    /// Computes directions at the points of a cloud, `[n, d]`: minus the gradient of the signature function.
    /// They point outward on closed clouds. The points are best in the order of a tree: where many that
    /// follow each other are near each other, the gradient is continued from the middle of them.
    ///
    /// # Errors
    /// Returns [`NumericsError::Cancelled`] and [`NumericsError::OutOfMemory`]. Other errors of the fit do
    /// not occur: regularised Laplace is positive definite in every dimension, no two points coincide, and α
    /// is 1e-3 or more. So the condition is below 1e7 for 6,000 points.
    fn directions_at(self, cloud: &Cloud, observer: &dyn Observer) -> Result<Vec<f64>, NumericsError> {
        let regularization = Regularization::uniform(self.alpha)?;
        let system = System::new(Arc::new(self.cloud), self.kernel, regularization)?;
        let solver = Arc::new(Solver::dense(system, observer)?);
        let signature = Interpolant::signature(solver, observer)?;
        let runs = Runs::of(cloud, REACH * self.spacing, observer)?;
        let mut directions = if runs.ranges.len() * WORTH_CONTINUING > cloud.n_points() {
            signature.at(cloud, JetOrder::Gradient, observer)?.gradients()
        } else {
            let jets = signature.at(&runs.middles, JetOrder::Hessian, observer)?;
            runs.continued(cloud, &jets, observer)?
        };
        directions.iter_mut().for_each(|g| *g = -*g);
        Ok(directions)
    }
}

/// Computes directions outward of the surface at the points, `[n, d]`, from a [`CoarseCloud`] of them.
///
/// # Errors
/// Returns [`NumericsError::Cancelled`] and [`NumericsError::OutOfMemory`].
pub(super) fn outward_directions(
    cloud: &Cloud,
    noise: f64,
    observer: &dyn Observer,
) -> Result<Vec<f64>, NumericsError> {
    CoarseCloud::of(cloud, None, noise, observer)?.directions_at(cloud, observer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::Unobserved;
    use crate::points::cloud::squared_distance;
    use crate::surface::local::tree_order::TreeOrder;
    use crate::testing::fibonacci_sphere;

    #[test]
    fn continued_gradients_point_where_gradients_do() {
        let cloud = fibonacci_sphere(20_000);
        let sampling = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
        let ordered = TreeOrder::of(&cloud, sampling).unwrap();
        let coarse = || CoarseCloud::of(&ordered.cloud, Some(300), 0.0, &Unobserved).unwrap();
        let runs = Runs::of(&ordered.cloud, REACH * coarse().spacing, &Unobserved).unwrap();
        assert!(runs.ranges.len() * WORTH_CONTINUING < 20_000, "{}", runs.ranges.len());
        let continued = coarse().directions_at(&ordered.cloud, &Unobserved).unwrap();
        for (x, direction) in ordered.cloud.points().zip(continued.chunks_exact(3)).step_by(971) {
            // There is nothing to continue to from a single point.
            let plain = coarse().directions_at(&Cloud::new(x.to_vec(), 3).unwrap(), &Unobserved).unwrap();
            let size = squared_distance(&plain, &[0.0; 3]);
            assert!(squared_distance(direction, &plain) < 1e-3 * size, "{direction:?} and {plain:?}");
        }
    }
}
