//! The offset model at a query of a surface: the points that it is fitted to, and a check of its answer.

mod layers;

use super::SignatureSurface;
use crate::machine::vector::{dot, norm};
use crate::points::patch::Patch;
use crate::points::quadric::n_coefficients;
pub(crate) use layers::OffsetJet;
use layers::{n_patch_points, offset_jet};

/// Spacings from the nearest point up to which the offset model is used.
const REACH_SPACINGS: f64 = 2.0;

/// Cosine to the normal of the nearest point above which a point belongs to the same side of the same sheet.
const SAME_SHEET: f64 = 0.4;

/// Least number of points of a patch per coefficient of a quadric.
const MIN_PER_COEFFICIENT: usize = 2;

/// Gradient norms |∇F| at which an answer is believed. A signed distance has 1. Outside this range the fit
/// has failed.
const GRADIENT_NORMS: std::ops::Range<f64> = 0.5..2.0;

/// Computes gradient and Hessian of the offset model at x. The gradient points outward.
///
/// `None` where the cloud does not support it. Then x is far from all points, too few points are on one sheet
/// around it, or the interpolant is no distance.
pub(crate) fn offset_jet_at(surface: &SignatureSurface, x: &[f64]) -> Option<OffsetJet> {
    let (cloud, d) = (surface.cloud(), surface.cloud().dimension());
    let nearest = surface.sampling.neighbours().nearest_positions(x, n_patch_points(d));
    let first = nearest.first()?;
    if first.squared_distance > (REACH_SPACINGS * surface.sampling.spacing(first.point)).powi(2) {
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
