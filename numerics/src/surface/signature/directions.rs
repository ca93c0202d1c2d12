//! Unit normals at the points, signed where the signature function tells the side. `orientation` decides the
//! rest.

use super::function::Signature;
use crate::error::Result;
use crate::machine::vector::norm;
use crate::observer::Observer;
use crate::orientation::Directions;
use crate::points::cloud::Cloud;
use crate::points::local_quadrics::LocalQuadrics;
use crate::points::sampling::Sampling;
use crate::regression::sums::jets::{JetOrder, Jets};
use crate::surface::flags::lacks_normal;

/// Step of the difference quotient along a local normal, in spacings, for kernels without a gradient at the
/// points.
const DIFFERENCE_STEP: f64 = 0.25;

/// Computes unit normals at the points, signed where the signature function tells the side.
///
/// # Errors
/// Returns the errors of [`crate::regression::function::interpolant::Interpolant::at`].
pub(crate) fn directions(
    signature: &Signature,
    sampling: &Sampling,
    quadrics: &LocalQuadrics,
    observer: &dyn Observer,
) -> Result<Directions> {
    let n = signature.function().solver.n_points();
    let (normals, has_sign) = match signature.jets() {
        Some(jets) => along_gradients(signature, jets, sampling, quadrics),
        None => along_quadrics(signature, sampling, quadrics, observer)?,
    };
    // The tip of a hairpin looks like the end of a curve, but no quadric fits there.
    let is_at_rim =
        |point| quadrics.at(point).is_some_and(|quadric| quadric.is_at_rim && quadric.is_reliable());
    Ok(Directions { normals, has_sign, is_at_rim: (0..n).map(is_at_rim).collect() })
}

/// Computes normals along −∇u. Where ∇u is not normal to the surface, the normal is that of the quadric, with
/// an unknown sign, or zero where there is no quadric.
fn along_gradients(
    signature: &Signature,
    jets: &Jets,
    sampling: &Sampling,
    quadrics: &LocalQuadrics,
) -> (Vec<f64>, Vec<bool>) {
    let (n, d) = (jets.n_queries(), jets.dimension());
    let (mut normals, mut has_sign) = (vec![0.0; n * d], vec![false; n]);
    for (point, slot) in normals.chunks_exact_mut(d).enumerate() {
        let quadric = quadrics.at(point);
        if signature.is_gradient_rounding_error(point)
            || lacks_normal(jets, point, sampling.spacing(point), quadric)
        {
            quadric.iter().for_each(|quadric| slot.copy_from_slice(quadric.normal));
            continue;
        }
        let gradient = jets.gradient(point);
        let length = norm(gradient);
        slot.iter_mut().zip(gradient).for_each(|(c, g)| *c = -g / length);
        has_sign[point] = true;
    }
    (normals, has_sign)
}

/// Computes normals for kernels without a gradient at the points.
///
/// The sign comes from `u(x + δν) − u(x − δν)`, ν the normal of the quadric. The kink of the kernel at x is
/// even, so it drops out.
fn along_quadrics(
    signature: &Signature,
    sampling: &Sampling,
    quadrics: &LocalQuadrics,
    observer: &dyn Observer,
) -> Result<(Vec<f64>, Vec<bool>)> {
    let function = signature.function();
    let cloud = function.solver.cloud();
    let (n, d) = (cloud.n_points(), cloud.dimension());
    let at = |side: f64| -> Result<Jets> {
        let mut moved = cloud.coordinates().to_vec();
        for (point, x) in moved.chunks_exact_mut(d).enumerate() {
            let step = side * DIFFERENCE_STEP * sampling.spacing(point);
            let normal = quadrics.at(point).map(|quadric| quadric.normal);
            x.iter_mut().zip(normal.into_iter().flatten()).for_each(|(x, c)| *x += step * c);
        }
        function.at(&Cloud::new(moved, d)?, JetOrder::Value, observer)
    };
    let (ahead, behind) = (at(1.0)?, at(-1.0)?);
    let (mut normals, mut has_sign) = (vec![0.0; n * d], vec![false; n]);
    for (point, slot) in normals.chunks_exact_mut(d).enumerate() {
        let Some(quadric) = quadrics.at(point) else { continue };
        // u is greater inside than outside, so a normal along which u grows points inward and is turned.
        let slope = ahead.value(point) - behind.value(point);
        let sign = if slope > 0.0 { -1.0 } else { 1.0 };
        slot.iter_mut().zip(quadric.normal).for_each(|(c, of_quadric)| *c = sign * of_quadric);
        has_sign[point] = slope != 0.0;
    }
    Ok((normals, has_sign))
}
