//! Kernels and small dense algebra shared by the tests of properties.

use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::solver::Solver;
use gramian_numerics::regression::sums::jets::{JetOrder, Jets};

pub use crate::common::kernels::all_families as families;

pub const EPS: f64 = f64::EPSILON;

/// Families with derivatives at the points of the cloud: all but Laplace ε = 0 and
/// Matérn 1/2, which have a kink.
pub fn families_without_kink() -> Vec<Family> {
    families().into_iter().filter(|&family| !kernel(family, 1.0).has_kink()).collect()
}

/// A kernel of variance 1.7, so that a forgotten or doubled factor shows.
pub fn kernel(family: Family, length_scale: f64) -> Kernel {
    Kernel::new(family, length_scale, 1.7).unwrap()
}

/// The length scale at which a family is as wide as Matérn at 1. That of Wendland is the radius of a support.
pub fn width(family: Family) -> f64 {
    if matches!(family, Family::Wendland { .. }) { 3.0 } else { 1.0 }
}

/// The cross Gram matrix `k(q_i, x_j)`, `[m, n]`, by evaluating each kernel translate at the queries.
pub fn cross_gram(cloud: &Cloud, kernel: &Kernel, queries: &Cloud) -> Vec<f64> {
    let (n, m) = (cloud.n_points(), queries.n_points());
    let mut matrix = vec![0.0; m * n];
    for j in 0..n {
        let mut weights = vec![0.0; n];
        weights[j] = 1.0;
        let jets = Jets::evaluate(cloud, kernel, &weights, queries, JetOrder::Value, &Unobserved).unwrap();
        (0..m).for_each(|i| matrix[i * n + j] = jets.value(i));
    }
    matrix
}

/// The lower triangular L of `A = LLᵀ`, by rows, from the textbook loop. `None` if A
/// is not positive definite.
pub fn cholesky(a: &[f64]) -> Option<Vec<f64>> {
    let n = a.len().isqrt();
    let mut l = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..=i {
            let rest = a[i * n + j] - dot(&l[i * n..][..j], &l[j * n..][..j]);
            if i == j && (rest <= 0.0 || rest.is_nan()) {
                return None;
            }
            l[i * n + j] = if i == j { rest.sqrt() } else { rest / l[j * n + j] };
        }
    }
    Some(l)
}

/// Solves for `L⁻¹ b`.
pub fn forward_solve(l: &[f64], b: &[f64]) -> Vec<f64> {
    let n = b.len();
    let mut x: Vec<f64> = Vec::with_capacity(n);
    for i in 0..n {
        x.push((b[i] - dot(&l[i * n..][..i], &x)) / l[i * n + i]);
    }
    x
}

/// `n ε cond(K + αI)`: the relative rounding error that a solve may leave in the weights.
pub fn rounding(factor: &Solver) -> f64 {
    factor.n_points() as f64 * EPS / factor.reciprocal_condition().unwrap()
}

/// The cloud moved by h along one axis.
pub fn shifted(cloud: &Cloud, axis: usize, h: f64) -> Cloud {
    let d = cloud.dimension();
    let moved = |(i, x): (usize, &f64)| if i % d == axis { x + h } else { *x };
    Cloud::new(cloud.coordinates().iter().enumerate().map(moved).collect(), d).unwrap()
}

pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// Largest magnitude, or NaN if any entry is NaN, so that no comparison with a tolerance passes it.
pub fn largest(a: impl IntoIterator<Item = f64>) -> f64 {
    a.into_iter().fold(0.0, |a, b| if b.is_nan() || b.abs() > a { b.abs() } else { a })
}

/// Largest difference of two lists of equal length.
pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    largest(a.iter().zip(b).map(|(a, b)| a - b))
}

/// The product of rotations in the coordinate planes, one angle each. Planes beyond the
/// last angle are not turned.
pub fn rotation(d: usize, angles: &[f64]) -> Vec<f64> {
    let mut matrix: Vec<f64> = (0..d * d).map(|at| f64::from(u8::from(at / d == at % d))).collect();
    let planes = (0..d).flat_map(|a| (a + 1..d).map(move |b| (a, b)));
    for ((a, b), angle) in planes.zip(angles) {
        let (sin, cos) = angle.sin_cos();
        for column in 0..d {
            let (x, y) = (matrix[a * d + column], matrix[b * d + column]);
            matrix[a * d + column] = cos * x - sin * y;
            matrix[b * d + column] = sin * x + cos * y;
        }
    }
    matrix
}
