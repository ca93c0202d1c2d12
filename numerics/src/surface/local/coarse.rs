//! The outward side of a surface, from the signature function of a subset of its points.

use std::sync::Arc;

use crate::error::NumericsError;
use crate::function::interpolant::Interpolant;
use crate::kernel::Kernel;
use crate::kernel::defaults::{Purpose, default_fit};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::duplicates::Merge;
use crate::points::sampling::Sampling;
use crate::points::thinning::{n_coarse, thinned_points};
use crate::solver::{Solver, System};
use crate::sums::jets::JetOrder;
use crate::sums::regularization::Regularization;

/// A part of a cloud whose signature function says which side of the surface is outward.
pub struct Coarse {
    /// The points, ascending. No two coincide.
    pub points: Vec<usize>,
    pub kernel: Kernel,
    /// α: added to the diagonal of the kernel's matrix.
    pub alpha: f64,
    cloud: Cloud,
}

impl Coarse {
    /// Chooses `count` points that are spread as the cloud is, or a sixth of a small cloud and at most 6,000
    /// if that is `None`. `noise` is the standard deviation of the points across the surface, unit L.
    ///
    /// # Errors
    /// Returns [`NumericsError::Cancelled`].
    pub fn of(
        cloud: &Cloud,
        count: Option<usize>,
        noise: f64,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        let mut points = thinned_points(cloud, count.unwrap_or_else(|| n_coarse(cloud.n_points())));
        let mut coarse = cloud.select(&points);
        if let Some((merged, merge)) = Merge::duplicates_of(&coarse) {
            points = (0..merged.n_points()).map(|group| points[merge.first_point(group)]).collect();
            coarse = merged;
        }
        let sampling = Sampling::of(&coarse, observer)?;
        let (kernel, alpha) = default_fit(sampling.scales(), Purpose::Normals, || noise)?;
        Ok(Self { points, kernel, alpha, cloud: coarse })
    }

    /// Computes directions at the points of a cloud, `[n, d]`: minus the gradient of the signature function.
    /// They point outward on closed clouds.
    ///
    /// # Errors
    /// Returns [`NumericsError::Cancelled`]. Errors of the fit do not occur with this kernel and α.
    fn directions_at(self, cloud: &Cloud, observer: &dyn Observer) -> Result<Vec<f64>, NumericsError> {
        let regularization = Regularization::uniform(self.alpha)?;
        let system = System::new(Arc::new(self.cloud), self.kernel, regularization)?;
        let solver = Arc::new(Solver::dense(system, observer)?);
        let signature = Interpolant::signature(solver, observer)?;
        let mut directions = signature.at(cloud, JetOrder::Gradient, observer)?.gradients();
        directions.iter_mut().for_each(|g| *g = -*g);
        Ok(directions)
    }
}

/// Computes directions outward of the surface at the points, `[n, d]`, from a [`Coarse`] part of them.
///
/// # Errors
/// Returns [`NumericsError::Cancelled`].
pub(super) fn outward_directions(
    cloud: &Cloud,
    noise: f64,
    observer: &dyn Observer,
) -> Result<Vec<f64>, NumericsError> {
    Coarse::of(cloud, None, noise, observer)?.directions_at(cloud, observer)
}
