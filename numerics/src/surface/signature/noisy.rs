//! Sides of noisy plane curves.

use std::sync::Arc;

use crate::error::Result;
use crate::observer::Observer;
use crate::orientation::OrientedNormals;
use crate::points::cloud::Cloud;
use crate::points::sampling::Sampling;
use crate::surface::local::{LocalInputs, LocalSurface};

/// Orients the points of a plane curve by local regressions, if their noise is such that the gradients of the
/// signature function and the steps between neighbours do not tell the sides. `None` for other clouds.
///
/// The points of a curve have two neighbours each. Noise of three tenths of their distance turns the steps
/// between them by half a right angle and more, and a fifth to a third of the normals of 300 points were
/// flipped. Surfaces have neighbours all around, of which most agree.
///
/// # Errors
/// Returns the errors of [`LocalSurface::of`].
pub(super) fn oriented_curve(
    cloud: &Arc<Cloud>,
    sampling: &Arc<Sampling>,
    observer: &dyn Observer,
) -> Result<Option<OrientedNormals>> {
    if cloud.dimension() != 2 {
        return Ok(None);
    }
    let local = LocalSurface::of(cloud.clone(), sampling.clone(), LocalInputs::default(), observer)?;
    Ok(local.is_noisy().then(|| local.oriented()))
}
