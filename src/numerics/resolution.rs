//! T4: whether the neighbours confirm the curvatures of a surface.
//!
//! A kernel that is too wide or too narrow for the sampling gives smooth, wrong curvatures. Two opinions that do not depend
//! on it are at hand: a quadric through some neighbours, cheap and coarse, and the offset model on a patch, which costs as
//! much as a hundred quadrics. Where the quadric agrees, nothing more is asked; where it does not, the patch decides.

use super::patch::LocalFit;
use super::rescue::rescue;
use super::shape::principal_curvatures;
use super::surface::Surface;

/// Differences, against the largest curvature, up to which the quadric confirms, and up to which the patch does.
const CONFIRMED_BY_QUADRIC: f64 = 0.07;
const CONFIRMED_BY_PATCH: f64 = 0.10;

/// The same for answers of the patch itself: the quadric is the coarser of the two.
const CONFIRMED_OFFSET: f64 = 0.30;

/// Curvature times radius below which the quartic terms that a quadric leaves out are small: `(κr)²/4` of a sphere's curvature.
const QUADRIC_BEND: f64 = 0.6;

/// Curvatures below this fraction of one over the radius of the cloud count as zero.
const FLAT: f64 = 0.1;

/// Angle by which the normal may turn from one point to the next for the sampling to show the surface at all.
const RESOLVED_TURN: f64 = 0.8;

/// Whether curvatures `[d−1]`, ascending for the outward normal `normal` at x, are confirmed by the points around x.
pub(crate) fn is_resolved(
    surface: &Surface,
    x: &[f64],
    spacing: f64,
    normal: &[f64],
    curvatures: &[f64],
    fit: Option<&LocalFit>,
    is_offset: bool,
) -> bool {
    let largest = curvatures.iter().fold(0.0, |a: f64, k| a.max(k.abs()));
    if largest * spacing > RESOLVED_TURN {
        return false;
    }
    let floor = FLAT / surface.radius();
    let differ = |other: &[f64]| {
        let largest = curvatures.iter().chain(other).fold(floor, |a, k| a.max(k.abs()));
        curvatures.iter().zip(other).fold(0.0, |a: f64, (k, o)| a.max((k - o).abs())) / largest
    };
    let by_quadric =
        fit.filter(|fit| fit.is_reliable()).map(|fit| (differ(&fit.curvatures_for(normal)), fit.bend()));
    if is_offset {
        return by_quadric.is_some_and(|(difference, _)| difference <= CONFIRMED_OFFSET);
    }
    if by_quadric.is_some_and(|(difference, bend)| difference <= CONFIRMED_BY_QUADRIC && bend < QUADRIC_BEND)
    {
        return true;
    }
    rescue(surface, x).is_some_and(|jet| {
        let (other, _) = principal_curvatures(&jet.gradient, &jet.hessian, 1.0);
        differ(&other) <= CONFIRMED_BY_PATCH
    })
}
