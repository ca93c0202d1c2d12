//! Weights by smoothed polyharmonic splines with polynomials.
//!
//! Without smoothing these are the weights of RBF-FD (Flyer, Fornberg, Bayona and Barnett 2016). Nodes near
//! each other then get large weights of both signs, and the diagonal of a random cloud is positive in one row
//! of fifty. Smoothing splines add a penalty μ of squared weights, so that nodes near each other share their
//! weight. For μ → ∞ the weights are those of moving least squares.
//!
//! The penalty of the query's own node is μ/n, which makes the diagonal dominate. It is after Liang and Zhao
//! (2013), who give it n times the weight of another node. On random spheres errors are 1.4 times those of
//! RBF-FD, and 7 times for moving least squares (docs/numerics.md).

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::super::Operator;
use super::disc::Disc;
use crate::machine::vector::dot;
use crate::points::monomials::exponents;

/// Largest sum of the magnitudes of weights over scaled coordinates, in units of `n^{order/k}` of regular
/// nodes. Beyond it the weights multiply the noise of the nodes. Regular nodes have about 2 around a point,
/// and ten times that at a rim.
const UNSTABLE: f64 = 200.0;

/// Largest error of the weights for a polynomial, over the sum of their magnitudes. Beyond it the nodes do
/// not determine the weights.
const INDETERMINATE: f64 = 1e-9;

/// Returns the penalty μ of squared weights of the Laplacian at a node, over the scaled coordinates.
///
/// On a curve the nodes of a row are nearer to each other in units of the radius, so the splines between them
/// are smaller.
fn smoothing(k: usize) -> f64 {
    if k == 1 { 1e-4 } else { 0.01 }
}

/// Penalty of squared weights elsewhere: far below the splines between neighbours, far above those between
/// near duplicates.
const SLIGHT: f64 = 1e-5;

/// Computes weights of the derivatives at 0 for values at the scaled coordinates: `[n]` for the Laplacian,
/// `[k, n]` for the gradient.
///
/// Solves `[Φ − D P; Pᵀ 0] [w; λ] = [Lφ; Lp]`, D the penalties. `None` where the nodes do not determine
/// polynomials of this degree, for example on a few lines of nodes. `None` also where the weights would
/// multiply noise.
pub(super) fn weights(disc: &Disc, degree: usize, operator: Operator) -> Option<Vec<f64>> {
    let (n, k) = (disc.n_nodes(), disc.k);
    let exponents = exponents(k, degree);
    let matrix = matrix(disc, &exponents, operator);
    let right = right_side(disc, &exponents, operator);
    let n_forms = right.ncols();
    let solution = matrix.partial_piv_lu().solve(&right);
    let weights: Vec<f64> =
        (0..n_forms).flat_map(|form| (0..n).map(move |j| (j, form))).map(|at| solution[at]).collect();
    let are_right = |form: usize| {
        let weights = &weights[form * n..][..n];
        let total: f64 = weights.iter().map(|weight| weight.abs()).sum();
        let error = |term: usize| {
            let found: f64 = (0..n).map(|j| weights[j] * matrix[(j, n + term)]).sum();
            (found - right[(n + term, form)]).abs()
        };
        // NaN where the system is singular.
        total <= UNSTABLE * (n as f64).powf(operator.order().degree() as f64 / k as f64)
            && (0..exponents.len()).all(|term| error(term) <= INDETERMINATE * (1.0 + total))
    };
    (0..n_forms).all(are_right).then_some(weights)
}

/// Returns the matrix `[Φ − D P; Pᵀ 0]`.
fn matrix(disc: &Disc, exponents: &[Vec<usize>], operator: Operator) -> Mat<f64> {
    let n = disc.n_nodes();
    let size = n + exponents.len();
    let mut matrix = Mat::<f64>::zeros(size, size);
    for i in 0..n {
        for j in 0..i {
            let squared: f64 = disc.point(i).iter().zip(disc.point(j)).map(|(a, b)| (a - b) * (a - b)).sum();
            let spline = squared * squared * squared.sqrt();
            (matrix[(i, j)], matrix[(j, i)]) = (spline, spline);
        }
        matrix[(i, i)] = -penalty(disc, i, operator);
        for (term, powers) in exponents.iter().enumerate() {
            let value = monomial(disc.point(i), powers);
            (matrix[(i, n + term)], matrix[(n + term, i)]) = (value, value);
        }
    }
    matrix
}

/// Returns the penalty of the squared weight of a node.
fn penalty(disc: &Disc, node: usize, operator: Operator) -> f64 {
    match operator {
        Operator::LaplaceBeltrami if disc.is_at_node && node == 0 => {
            smoothing(disc.k) / disc.n_nodes() as f64
        }
        Operator::LaplaceBeltrami if disc.is_at_node => smoothing(disc.k),
        Operator::LaplaceBeltrami | Operator::SurfaceGradient => SLIGHT,
    }
}

/// Returns the right-hand sides `[Lφ; Lp]`, a column for each derivative.
fn right_side(disc: &Disc, exponents: &[Vec<usize>], operator: Operator) -> Mat<f64> {
    let (n, k) = (disc.n_nodes(), disc.k);
    let n_forms = if operator == Operator::LaplaceBeltrami { 1 } else { k };
    let mut right = Mat::<f64>::zeros(n + exponents.len(), n_forms);
    for j in 0..n {
        let cubed = dot(disc.point(j), disc.point(j)).powf(1.5);
        for form in 0..n_forms {
            right[(j, form)] = match operator {
                Operator::LaplaceBeltrami => (15 + 5 * k) as f64 * cubed,
                Operator::SurfaceGradient => -5.0 * cubed * disc.point(j)[form],
            };
        }
    }
    for (term, powers) in exponents.iter().enumerate() {
        for form in 0..n_forms {
            right[(n + term, form)] = derivative_at_zero(powers, form, operator);
        }
    }
    right
}

pub(super) fn monomial(point: &[f64], powers: &[usize]) -> f64 {
    point.iter().zip(powers).map(|(t, &power)| t.powi(power as i32)).product()
}

/// Returns a derivative of a monomial at 0: the Laplacian, or the derivative along the axis `form`.
pub(super) fn derivative_at_zero(powers: &[usize], form: usize, operator: Operator) -> f64 {
    let total: usize = powers.iter().sum();
    match operator {
        Operator::LaplaceBeltrami if total == 2 && powers.contains(&2) => 2.0,
        Operator::SurfaceGradient if total == 1 && powers[form] == 1 => 1.0,
        Operator::LaplaceBeltrami | Operator::SurfaceGradient => 0.0,
    }
}
