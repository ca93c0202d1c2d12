//! Weights of the Laplacian at a node, none of them negative except the diagonal (positive stencils: Seibold
//! 2008).
//!
//! Rows of this kind alone make a matrix without eigenvalues of positive real part (Gershgorin). Weights
//! `w_j = v_j/|t_j|²` with v_j ≥ 0 are exact for polynomials of degree 2 if `Σ w_j t_j = 0` and
//! `Σ w_j t_j t_jᵀ = 2I`. Where nodes do not surround the query, at a rim for example, no such weights exist.
//! Then the weights with the least squared error of these moments act like a no-flux (homogeneous Neumann)
//! boundary.

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::disc::Disc;
use crate::machine::vector::{dot, norm};

/// Penalty of `|t_j|² v_j²`. It makes the weights unique and prefers near nodes.
const PREFERENCE: f64 = 1e-5;

/// Largest error of a moment at which weights count as exact. The penalty alone causes less.
const INEXACT: f64 = 1e-3;

/// Slope of the objective along a weight that is 0, relative to the largest at the start, above which the
/// weight becomes positive.
const NEGLIGIBLE: f64 = 1e-14;

/// Distance over the radius of the disc up to which a node counts as the query itself.
const COINCIDENT: f64 = 1e-8;

/// Positive weights of the Laplacian on a disc.
pub(super) struct Positive {
    /// Weights over the scaled coordinates, `[n]`. Their sum is 0.
    pub(super) weights: Vec<f64>,
    /// True if the weights are exact for polynomials of degree 2.
    pub(super) is_exact: bool,
}

/// Computes positive weights on a disc whose first node is the query. `None` without another node.
pub(super) fn weights(disc: &Disc) -> Option<Positive> {
    let others: Vec<usize> =
        (0..disc.n_nodes()).filter(|&node| norm(disc.point(node)) > COINCIDENT).collect();
    if others.is_empty() {
        return None;
    }
    let columns: Vec<Vec<f64>> = others.iter().map(|&node| moments(disc.point(node))).collect();
    let target = target(disc.k);
    let matrix = Mat::from_fn(others.len(), others.len(), |i, j| {
        let penalty = if i == j { PREFERENCE * norm(disc.point(others[i])).powi(2) } else { 0.0 };
        dot(&columns[i], &columns[j]) + penalty
    });
    let right: Vec<f64> = columns.iter().map(|column| dot(column, &target)).collect();
    let found = nonnegative_minimum(&matrix, &right);
    let error = |moment: usize| {
        let sum: f64 = found.iter().zip(&columns).map(|(v, column)| v * column[moment]).sum();
        (sum - target[moment]).abs()
    };
    let is_exact = (0..target.len()).all(|moment| error(moment) <= INEXACT);
    let mut weights = vec![0.0; disc.n_nodes()];
    for (&node, v) in others.iter().zip(&found) {
        weights[node] = v / norm(disc.point(node)).powi(2);
    }
    weights[0] = -weights.iter().sum::<f64>();
    Some(Positive { weights, is_exact })
}

/// Returns `t/|t|²` and the entries of `t tᵀ/|t|²`. Mixed entries are multiplied by √2, so that squared
/// errors do not depend on the axes.
fn moments(t: &[f64]) -> Vec<f64> {
    let squared = norm(t).powi(2);
    let second = |(a, b): (usize, usize)| if a == b { t[a] * t[a] } else { 2f64.sqrt() * t[a] * t[b] };
    let seconds = (0..t.len()).flat_map(|a| (0..=a).map(move |b| (a, b))).map(second);
    t.iter().copied().chain(seconds).map(|moment| moment / squared).collect()
}

/// Returns the moments of the Laplacian, in the order of [`moments`].
fn target(k: usize) -> Vec<f64> {
    let seconds = (0..k).flat_map(|a| (0..=a).map(move |b| if a == b { 2.0 } else { 0.0 }));
    std::iter::repeat_n(0.0, k).chain(seconds).collect()
}

/// Finds the v ≥ 0 with the least `½vᵀGv − hᵀv` for a positive definite G, by active sets (Lawson and Hanson
/// 1974, ch. 23).
fn nonnegative_minimum(matrix: &Mat<f64>, right: &[f64]) -> Vec<f64> {
    let n = right.len();
    let (mut v, mut is_free) = (vec![0.0; n], vec![false; n]);
    let least = NEGLIGIBLE * right.iter().fold(0.0, |a: f64, h| a.max(h.abs()));
    // The objective decreases from set to set, so that no set comes twice. The bound guards against rounding.
    for _ in 0..3 * n {
        let slope = |i: usize| right[i] - (0..n).map(|j| matrix[(i, j)] * v[j]).sum::<f64>();
        let slopes = (0..n).filter(|&i| !is_free[i]).map(|i| (slope(i), i));
        let steepest = slopes.reduce(|best, next| if next.0 > best.0 { next } else { best });
        let Some((_, entering)) = steepest.filter(|&(slope, _)| slope > least) else { break };
        is_free[entering] = true;
        while !is_minimal_over_free(matrix, right, &mut v, &mut is_free) {}
    }
    v
}

/// Moves v to the minimum over its free entries and returns true. If an entry reaches 0 on the way, v stops
/// there, that entry is no longer free, and the answer is false.
fn is_minimal_over_free(matrix: &Mat<f64>, right: &[f64], v: &mut [f64], is_free: &mut [bool]) -> bool {
    let free: Vec<usize> = (0..v.len()).filter(|&i| is_free[i]).collect();
    let system = Mat::from_fn(free.len(), free.len(), |i, j| matrix[(free[i], free[j])]);
    let minimum = system.partial_piv_lu().solve(&Mat::from_fn(free.len(), 1, |i, _| right[free[i]]));
    let share = |at: usize| {
        let (from, to) = (v[free[at]], minimum[(at, 0)]);
        if to > 0.0 { 1.0 } else { from / (from - to).max(f64::MIN_POSITIVE) }
    };
    let shares: Vec<f64> = (0..free.len()).map(share).collect();
    let reached = shares.iter().copied().fold(1.0, f64::min);
    for (at, &i) in free.iter().enumerate() {
        v[i] += reached * (minimum[(at, 0)] - v[i]);
        if minimum[(at, 0)] <= 0.0 && shares[at] <= reached {
            (v[i], is_free[i]) = (0.0, false);
        }
    }
    free.iter().all(|&i| is_free[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_minimum_satisfies_the_conditions_of_kuhn_and_tucker() {
        let matrix = Mat::from_fn(4, 4, |i, j| 1.0 / (1 + i + j) as f64 + if i == j { 0.1 } else { 0.0 });
        for right in [[1.0, -1.0, 0.5, 0.2], [-1.0, -2.0, -3.0, -4.0], [0.1, 0.9, 0.2, 0.8]] {
            let v = nonnegative_minimum(&matrix, &right);
            for i in 0..4 {
                let slope = right[i] - (0..4).map(|j| matrix[(i, j)] * v[j]).sum::<f64>();
                assert!(v[i] >= 0.0 && slope < 1e-12 && (v[i] * slope).abs() < 1e-12, "{v:?} {slope}");
            }
        }
    }
}
