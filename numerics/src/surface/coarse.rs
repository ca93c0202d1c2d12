//! The outward side of a surface, from the signature function of a subset of its points.

use std::sync::Arc;

use crate::error::Result;
use crate::function::interpolant::Interpolant;
use crate::kernel::defaults::{Purpose, default_fit};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::duplicates::Merge;
use crate::points::sampling::Sampling;
use crate::points::thinning::{n_coarse, thinned};
use crate::solver::{Solver, System};
use crate::sums::jets::JetOrder;
use crate::sums::regularization::Regularization;

/// Computes directions at the points, `[n, d]`: minus the gradient of a coarse signature function.
///
/// They point outward on closed clouds. `noise` is the standard deviation of the points across the surface,
/// unit L.
///
/// # Errors
/// Returns `NumericsError::Cancelled`. Errors of the fit do not occur with this kernel and α.
pub(crate) fn outward_directions(cloud: &Cloud, noise: f64, observer: &dyn Observer) -> Result<Vec<f64>> {
    let coarse = thinned(cloud, n_coarse(cloud.n_points()));
    let coarse = match Merge::duplicates_of(&coarse) {
        Some((merged, _)) => merged,
        None => coarse,
    };
    let sampling = Sampling::of(&coarse, observer)?;
    let (kernel, alpha) = default_fit(sampling.scales(), Purpose::Normals, || noise)?;
    let system = System::new(Arc::new(coarse), kernel, Regularization::uniform(alpha)?)?;
    let solver = Arc::new(Solver::dense(system, observer)?);
    let signature = Interpolant::signature(solver, observer)?;
    let mut directions = signature.at(cloud, JetOrder::Gradient, observer)?.gradients();
    directions.iter_mut().for_each(|g| *g = -*g);
    Ok(directions)
}
