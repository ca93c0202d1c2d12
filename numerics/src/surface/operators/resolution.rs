//! Whether nodes resolve the surface around a query.

use super::super::degeneracy::Resolution;
use super::Operator;
use crate::machine::vector::{dot, norm};

/// Relative error of the test function from which nodes do not resolve the surface.
const UNRESOLVED: f64 = 0.1;

/// Curvature of the test function at least, in units of the radius of the nodes: on flat surfaces too weights are to bear a function that
/// bends.
const LEAST_CURVATURE: f64 = 0.3;

/// Tries weights of scaled forms (one for the Laplacian, k for the gradient, `[forms, n]`) on a function whose derivatives are known: the
/// height of a sphere over its tangent plane, with the largest curvature κ of the surface in units of the radius of the nodes,
/// `g(t) = (1 − √(1 − κ²|t|²))/κ`, of which the Laplacian at 0 is kκ and the gradient 0. Coordinates along the surface, `[n, k]`,
/// are exact whatever the curvature.
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
    // Not a number where nodes lie beyond the sphere.
    if error.abs() <= UNRESOLVED * scale { Resolution::Resolved } else { Resolution::Unresolved }
}
