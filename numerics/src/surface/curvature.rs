//! The shape operator of a level surface, from the gradient and the Hessian of its function.

use crate::machine::eigen::symmetric_eigen;
use crate::machine::small::{Small, zeros};
use crate::machine::vector::{dot, norm, tangent_basis};

/// Curvature times the radius of the cloud up to which a surface counts as flat.
pub(super) const FLAT: f64 = 0.1;

/// Computes the principal curvatures `[d−1]`, ascending, 1/L, and their directions `[d−1, d]`.
///
/// They are the eigenpairs of `S = σ P D²u P/|∇u|` on the tangent space, with `P = I − ννᵀ` and ν = σ∇u/|∇u|
/// (errata.md, 3).
///
/// Directions are orthonormal and tangent, and their component of largest magnitude is positive. A sphere of
/// radius r with outward ν has curvatures +1/r. The gradient must not be zero.
pub(crate) fn principal_curvatures(gradient: &[f64], hessian: &[f64], sign: f64) -> (Small, Small) {
    let d = gradient.len();
    let length = norm(gradient);
    let normal: Small = gradient.iter().map(|g| g / length).collect();
    let basis = tangent_basis(&normal);
    let mut images = zeros(basis.len());
    for (image, v) in images.chunks_exact_mut(d).zip(basis.chunks_exact(d)) {
        image.iter_mut().zip(hessian.chunks_exact(d)).for_each(|(slot, row)| *slot = dot(row, v));
    }
    let scale = sign / length;
    let shape: Small =
        basis.chunks_exact(d).flat_map(|a| images.chunks_exact(d).map(move |b| scale * dot(a, b))).collect();
    let (values, vectors) = symmetric_eigen(&shape, d - 1);
    let mut directions = zeros(basis.len());
    for (direction, vector) in directions.chunks_exact_mut(d).zip(vectors.chunks_exact(d - 1)) {
        for (axis, c) in basis.chunks_exact(d).zip(vector) {
            direction.iter_mut().zip(axis).for_each(|(v, a)| *v += c * a);
        }
        make_largest_positive(direction);
    }
    (values, directions)
}

/// Flips a vector so that its component of largest magnitude is positive. On a tie the first one counts.
fn make_largest_positive(v: &mut [f64]) {
    let largest = v.iter().fold(0.0, |a: f64, &b| if b.abs() > a.abs() { b } else { a });
    if largest < 0.0 {
        v.iter_mut().for_each(|x| *x = -*x);
    }
}

/// Returns the trace of a Hessian over the tangent space, `tr H − νᵀHν`.
pub(crate) fn tangential_trace(hessian: &[f64], normal: &[f64]) -> f64 {
    let d = normal.len();
    let trace: f64 = (0..d).map(|i| hessian[i * d + i]).sum();
    let normal_part: f64 = (0..d).map(|i| normal[i] * dot(&hessian[i * d..][..d], normal)).sum();
    trace - normal_part
}
