//! A test of whether nodes resolve the surface around a query.

use super::Operator;
use crate::machine::vector::{dot, norm};
use crate::surface::flags::Resolution;

/// Relative error on the test function beyond which nodes do not resolve the surface.
const UNRESOLVED: f64 = 0.1;

/// Least curvature of the test function, times the radius of the nodes. On flat surfaces, too, weights must
/// handle a function that bends.
const LEAST_CURVATURE: f64 = 0.3;

/// Tests weights on a function whose derivatives at the query are known.
///
/// `forms` are weights over scaled coordinates, `[forms, n]`: one form for the Laplacian, k for the gradient.
/// Coordinates along the surface, `[n, k]`, are exact whatever the curvature.
///
/// The function is the height of a sphere over its tangent plane, `g(t) = (1 − √(1 − κ²|t|²))/κ`. Its
/// curvature κ is the largest one of the surface times the radius of the nodes. Its Laplacian at 0 is kκ and
/// its gradient 0.
pub(super) fn resolution(
    forms: &[f64],
    coordinates: &[f64],
    k: usize,
    curvature: f64,
    operator: Operator,
) -> Resolution {
    let curvature = curvature.max(LEAST_CURVATURE);
    let height = |t: &[f64]| curvature * dot(t, t) / (1.0 + (1.0 - curvature.powi(2) * dot(t, t)).sqrt());
    let heights: Vec<f64> = coordinates.chunks_exact(k).map(height).collect();
    let found: Vec<f64> = forms.chunks_exact(heights.len()).map(|form| dot(form, &heights)).collect();
    let (error, scale) = match operator {
        Operator::LaplaceBeltrami => (found[0] - k as f64 * curvature, k as f64 * curvature),
        Operator::SurfaceGradient => (norm(&found), 1.0),
    };
    // NaN, and so unresolved, where nodes lie beyond the sphere.
    if error.abs() <= UNRESOLVED * scale { Resolution::Resolved } else { Resolution::Unresolved }
}
