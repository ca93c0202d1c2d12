//! Which side is outside, from the signature function of a part of the points.

use std::sync::Arc;

use crate::defaults::{Purpose, default_fit};
use crate::error::NumericsError;
use crate::function::interpolant::Interpolant;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::duplicates::Merge;
use crate::points::sampling::Sampling;
use crate::points::thinning::{n_coarse, thinned};
use crate::solver::{Solver, System};
use crate::sums::jets::JetOrder;
use crate::sums::regularization::Regularization;

/// Minus the gradient of a coarse signature function at the points, `[n, d]`: outward on closed clouds. `noise` is the standard
/// deviation of the points across the surface.
///
/// # Errors
/// Those of the fit, which with this kernel and α do not occur; [`NumericsError::Cancelled`].
pub(crate) fn outward_directions(
    cloud: &Cloud,
    noise: f64,
    observer: &dyn Observer,
) -> Result<Vec<f64>, NumericsError> {
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
