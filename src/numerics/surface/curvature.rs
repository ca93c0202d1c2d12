//! The shape operator of a level surface, from the gradient and the Hessian of its function.

use crate::numerics::machine::eigen::symmetric_eigen;
use crate::numerics::machine::vector::{dot, norm, tangent_basis};

/// Principal curvatures `[d−1]`, ascending, 1/L, and their directions: eigenpairs of `S = σ P D²u P/|∇u|`,
/// `P = I − ννᵀ`, ν = σ∇u/|∇u|, on the tangent space (errata.md, 3).
///
/// Directions are orthonormal and tangent, the component of largest magnitude positive. Sphere of radius r, ν outward: all
/// +1/r. The gradient must not be zero.
pub(crate) fn principal_curvatures(
    gradient: &[f64],
    hessian: &[f64],
    sign: f64,
) -> (Vec<f64>, Vec<Vec<f64>>) {
    let d = gradient.len();
    let length = norm(gradient);
    let normal: Vec<f64> = gradient.iter().map(|g| g / length).collect();
    let basis = tangent_basis(&normal);
    let image = |v: &[f64]| (0..d).map(|i| dot(&hessian[i * d..][..d], v)).collect::<Vec<f64>>();
    let images: Vec<Vec<f64>> = basis.iter().map(|v| image(v)).collect();
    let scale = sign / length;
    let shape: Vec<f64> = basis.iter().flat_map(|a| images.iter().map(move |b| scale * dot(a, b))).collect();
    let (values, vectors) = symmetric_eigen(&shape, d - 1);
    (values, vectors.iter().map(|vector| in_space(&basis, vector)).collect())
}

/// The tangent vector with these coordinates in a basis, its largest component positive.
fn in_space(basis: &[Vec<f64>], coordinates: &[f64]) -> Vec<f64> {
    let mut v = vec![0.0; basis.len() + 1];
    for (axis, c) in basis.iter().zip(coordinates) {
        v.iter_mut().zip(axis).for_each(|(v, a)| *v += c * a);
    }
    make_largest_positive(&mut v);
    v
}

/// Flips a vector so that its component of largest magnitude is positive; the first of several.
fn make_largest_positive(v: &mut [f64]) {
    let largest = v.iter().fold(0.0, |a: f64, &b| if b.abs() > a.abs() { b } else { a });
    if largest < 0.0 {
        v.iter_mut().for_each(|x| *x = -*x);
    }
}
