//! Weights for nodes that do not determine the derivatives.

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::super::Operator;
use super::disc::Disc;
use super::radial::{derivative_at_zero, monomial};
use crate::points::monomials::exponents;

/// Degree of the polynomials.
const DEGREE: usize = 2;

/// Share of the trace of PᵀP below which a combination of monomials counts as not determined.
const INDETERMINATE: f64 = 1e-8;

/// Computes weights over the scaled coordinates, `[n]` for the Laplacian, `[k, n]` for the gradient.
///
/// `w = P(PᵀP + εI)⁻¹Lp`, P the monomials up to degree 2 less their means. Constants vanish, and polynomials
/// of degree 2 are reproduced as far as the nodes determine them. Derivatives along directions without nodes
/// are 0.
pub(super) fn weights(disc: &Disc, operator: Operator) -> Vec<f64> {
    let (n, k) = (disc.n_nodes(), disc.k);
    let exponents: Vec<Vec<usize>> =
        exponents(k, DEGREE).into_iter().filter(|powers| powers.iter().any(|&power| power > 0)).collect();
    let mean = |powers: &[usize]| (0..n).map(|j| monomial(disc.point(j), powers)).sum::<f64>() / n as f64;
    let means: Vec<f64> = exponents.iter().map(|powers| mean(powers)).collect();
    let monomials =
        Mat::from_fn(n, means.len(), |j, term| monomial(disc.point(j), &exponents[term]) - means[term]);
    let mut normal = monomials.transpose() * &monomials;
    let trace: f64 = (0..means.len()).map(|term| normal[(term, term)]).sum();
    (0..means.len()).for_each(|term| normal[(term, term)] += INDETERMINATE * trace);
    let n_forms = if operator == Operator::LaplaceBeltrami { 1 } else { k };
    let right =
        Mat::from_fn(means.len(), n_forms, |term, form| derivative_at_zero(&exponents[term], form, operator));
    let found = &monomials * normal.partial_piv_lu().solve(&right);
    (0..n_forms).flat_map(|form| (0..n).map(move |j| (j, form))).map(|at| found[at]).collect()
}
