//! Normals that the points around them do not confirm.
//!
//! A smooth kernel with a small α follows the noise and the edges of a scan. Quadrics through a few points
//! reveal some of these errors. Where normal and quadric do not clearly agree, the local regression decides,
//! because it also estimates its own error.

use super::SignatureSurface;
use crate::error::Result;
use crate::machine::vector::{dot, norm};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::local_quadrics::LocalQuadric;
use crate::points::quadric::n_quadric_neighbours;
use crate::surface::served::GeometryArrays;

/// Cosine of the angle to the normal of the quadric, 0.15 rad, up to which a normal is not doubted.
const PLAINLY: f64 = 0.989;

/// Cosine of the angle to the normal of the quadric, 25°, beyond which a normal is flagged where there is no
/// local regression.
const AGREES: f64 = 0.906;

/// Curvature times radius below which a quadric sees less than half of a circle.
const ONE_SIDE: f64 = 1.5;

/// Deviation of a normal, radians, beyond which it is flagged. It combines that of the regression and the
/// angle from it. The bound is higher than for the normals of regressions, since there are two estimates.
const UNCERTAIN: f64 = 0.4;

/// Returns whether the quadric of a query leaves the normal along a gradient in doubt.
pub(super) fn is_doubtful(gradient: &[f64], quadric: Option<LocalQuadric<'_>>) -> bool {
    !quadric.is_some_and(|quadric| quadric.bend() < ONE_SIDE && !is_off(gradient, quadric.normal, PLAINLY))
}

/// Finds the doubtful queries whose normals are uncertain.
///
/// # Errors
/// Returns the errors of [`crate::patches::Patches::of`].
pub(super) fn uncertain<'a>(
    surface: &SignatureSurface,
    queries: &Cloud,
    doubtful: &[usize],
    served: &GeometryArrays,
    quadric: impl Fn(usize) -> Option<LocalQuadric<'a>>,
    observer: &dyn Observer,
) -> Result<Vec<usize>> {
    let d = queries.dimension();
    // In a smaller cloud each point may see all others.
    if doubtful.is_empty() || surface.cloud().n_points() < 4 * n_quadric_neighbours(d) {
        return Ok(Vec::new());
    }
    let queries = queries.select(doubtful);
    let are_points = surface.sampling.neighbours().hold(&queries);
    let local = surface.patches(observer)?.at(&queries, &|query| are_points[query], false, observer)?;
    let is_uncertain = |at: usize, query: usize| {
        let gradient = served.gradient(query);
        if !local.is_known[at] {
            return quadric(query).is_some_and(|quadric| {
                quadric.bend() < ONE_SIDE && is_off(gradient, quadric.normal, AGREES)
            });
        }
        let cosine = (dot(gradient, &local.normals[at * d..][..d]) / norm(gradient)).abs().min(1.0);
        let is_certain = local.normal_std[at].hypot(cosine.acos()) <= UNCERTAIN;
        !is_certain
    };
    let uncertain = doubtful.iter().enumerate().filter(|&(at, &query)| is_uncertain(at, query));
    Ok(uncertain.map(|(_, &query)| query).collect())
}

fn is_off(gradient: &[f64], normal: &[f64], cosine: f64) -> bool {
    dot(gradient, normal).abs() < cosine * norm(gradient)
}
