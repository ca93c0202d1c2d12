//! The offset model at a query of a surface: which points it is fitted to, and whether its answer can be believed.

mod layers;

use super::SignatureSurface;
use crate::machine::vector::{dot, norm};
use crate::points::patch::Patch;
use crate::points::quadric::n_coefficients;
pub(crate) use layers::OffsetJet;
use layers::{n_patch_points, offset_jet};

/// Spacings from the nearest point up to which the offset model is asked.
const REACH_SPACINGS: f64 = 2.0;

/// Cosine to the normal of the nearest point above which a point belongs to the same side of the same sheet.
const SAME_SHEET: f64 = 0.4;

/// Points per coefficient of a quadric that a patch needs at least.
const MIN_PER_COEFFICIENT: usize = 2;

/// A signed distance has |∇F| = 1; so far from it the patch was not fitted.
const GRADIENT_NORMS: std::ops::Range<f64> = 0.5..2.0;

/// Gradient and Hessian of the offset model at x, the gradient pointing outward.
///
/// `None` where the cloud does not support it: x far from all points, too few points on one sheet around it, or an
/// interpolant that is no distance.
pub(crate) fn offset_jet_at(surface: &SignatureSurface, x: &[f64]) -> Option<OffsetJet> {
    let (cloud, d) = (surface.cloud(), surface.cloud().dimension());
    let nearest = surface.sampling().neighbours().nearest_positions(x, n_patch_points(d));
    let first = nearest.first()?;
    if first.squared_distance > (REACH_SPACINGS * surface.sampling().spacing(first.point)).powi(2) {
        return None;
    }
    let normal = surface.normal(first.point);
    let is_same_sheet = |&point: &usize| dot(surface.normal(point), normal) > SAME_SHEET;
    let points: Vec<usize> = nearest.iter().map(|found| found.point).filter(is_same_sheet).collect();
    if points.len() < MIN_PER_COEFFICIENT * n_coefficients(d) {
        return None;
    }
    let patch = Patch::of(cloud, x, points.iter().copied())?;
    let normals: Vec<f64> = points.iter().flat_map(|&point| surface.normal(point)).copied().collect();
    let jet = offset_jet(&patch, &normals).ok()?;
    let length = norm(&jet.gradient);
    let is_distance = GRADIENT_NORMS.contains(&length) && dot(&jet.gradient, normal) > 0.5 * length;
    is_distance.then_some(jet)
}
