//! Interpolation in a cluster's box, at Chebyshev's nodes along each axis.
//!
//! ```text
//! k(x, y) ≈ Σ_kl S_k(x) k(x_k, y_l) S_l(y)   between two well-separated clusters
//! ```
//!
//! with the nodes x_k of one grid and y_l of the other. S_k is a product over the axes of Lagrange's
//! polynomials of the nodes `t_i = cos((2i + 1)π/2p)`, where p nodes lie along an axis from −1 to 1.
//!
//! Sources: Fong and Darve 2009, sec. 3, for the interpolation; Wang, Krasny and Tlupova 2020 for its use
//! without transfers between levels.

use std::f64::consts::PI;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

use super::clusters::{Cluster, along};
use super::lists::SEPARATION;

/// Points whose polynomials are held at once.
const AT_ONCE: usize = 256;

/// Most axes of a grid.
pub(super) const MAX_DIMENSION: usize = 3;

/// Nodes in the box of a cluster.
pub(super) struct Grid<'a> {
    cluster: &'a Cluster,
    /// Number of nodes along each axis: 1 along those that the cloud does not have.
    counts: [usize; MAX_DIMENSION],
}

impl<'a> Grid<'a> {
    /// Creates the grid that interpolates kernels to about this part of their size, in well-separated boxes.
    ///
    /// Polynomials of degree p converge like `ρ⁻ᵖ`, where the kernel is analytic in an ellipse around the
    /// side of the box whose half-axes add up to ρ (Trefethen 2013, th. 8.2). Their foci are the ends of the
    /// side, and they reach the nearest point of another cluster. Short sides take few nodes.
    pub(super) fn of(cluster: &'a Cluster, accuracy: f64) -> Self {
        let distance = cluster.radius * (2.0 / SEPARATION - 1.0);
        let mut counts = [1; MAX_DIMENSION];
        for (count, half) in counts.iter_mut().zip(&cluster.half) {
            let z = distance / half;
            if z.is_finite() {
                *count = 1 + (-accuracy.ln() / (z + (z * z - 1.0).sqrt()).ln()).ceil() as usize;
            }
        }
        Self { cluster, counts }
    }

    pub(super) fn n_nodes(&self) -> usize {
        self.counts.iter().product()
    }

    /// Coordinates of the nodes, `[p, d]`, unit L.
    pub(super) fn nodes(&self) -> Vec<f64> {
        let Cluster { centre, axes, half, .. } = self.cluster;
        let d = centre.len();
        let [first, second, third] = self.counts;
        let mut found = Vec::with_capacity(self.n_nodes() * d);
        for k in 0..third {
            for j in 0..second {
                for i in 0..first {
                    for c in 0..d {
                        let steps =
                            [i, j, k].into_iter().zip(self.counts).zip(axes.chunks_exact(d).zip(half));
                        let step = |((at, count), (axis, half)): (_, (&[f64], &f64))| {
                            node(at, count) * half * axis[c]
                        };
                        found.push(centre[c] + steps.map(step).sum::<f64>());
                    }
                }
            }
        }
        found
    }

    /// Weights of the nodes whose far field is that of weighted points of the cluster, `[k, d]`.
    pub(super) fn weights(&self, points: &[f64], weights: &[f64]) -> Vec<f64> {
        let [first, second, third] = self.counts;
        let mut found = Mat::<f64>::zeros(first * second, third);
        let d = self.cluster.centre.len();
        for (points, weights) in points.chunks(AT_ONCE * d).zip(weights.chunks(AT_ONCE)) {
            let mut polynomials = self.polynomials(points);
            polynomials
                .last
                .col_iter_mut()
                .zip(weights)
                .for_each(|(column, &weight)| column.iter_mut().for_each(|x| *x *= weight));
            let Polynomials { others, last } = polynomials;
            matmul(found.as_mut(), Accum::Add, others.as_ref(), last.transpose(), 1.0, Par::Seq);
        }
        found.col_iter().flat_map(|column| column.iter().copied()).collect()
    }

    /// Adds to sums at points of the cluster, `[k, d]`, what values at the nodes interpolate there.
    pub(super) fn add_to(&self, sums: &mut [f64], points: &[f64], at_nodes: &[f64]) {
        let [first, second, third] = self.counts;
        let d = self.cluster.centre.len();
        let at_nodes = MatRef::from_column_major_slice(at_nodes, first * second, third);
        for (points, sums) in points.chunks(AT_ONCE * d).zip(sums.chunks_mut(AT_ONCE)) {
            let Polynomials { others, last } = self.polynomials(points);
            let along_last = at_nodes.transpose() * others;
            for ((sum, a), b) in sums.iter_mut().zip(along_last.col_iter()).zip(last.col_iter()) {
                *sum += a.iter().zip(b.iter()).map(|(a, b)| a * b).sum::<f64>();
            }
        }
    }

    /// The polynomials at some points `[k, d]`.
    fn polynomials(&self, points: &[f64]) -> Polynomials {
        let Cluster { centre, axes, half, .. } = self.cluster;
        let d = centre.len();
        let n_points = points.len() / d;
        let [first, second, third] = self.counts;
        let lagrange = self.counts.map(Lagrange::of);
        let mut others = Mat::zeros(first * second, n_points);
        let mut last = Mat::zeros(third, n_points);
        let mut values: [Vec<f64>; MAX_DIMENSION] = self.counts.map(|count| vec![1.0; count]);
        for (at, x) in points.chunks_exact(d).enumerate() {
            for (a, axis) in axes.chunks_exact(d).enumerate() {
                if self.counts[a] > 1 {
                    lagrange[a].fill(along(axis, x, centre) / half[a], &mut values[a]);
                }
            }
            let mut column = others.col_mut(at).iter_mut();
            for y in &values[1] {
                values[0].iter().zip(column.by_ref()).for_each(|(x, to)| *to = x * y);
            }
            last.col_mut(at).iter_mut().zip(&values[2]).for_each(|(to, z)| *to = *z);
        }
        Polynomials { others, last }
    }
}

/// Values of the polynomials at points, a column for each point.
struct Polynomials {
    /// Products of those along the first two axes, `[p₁ p₂, k]`.
    others: Mat<f64>,
    /// Those along the third axis, `[p₃, k]`.
    last: Mat<f64>,
}

/// Lagrange's polynomials of Chebyshev's nodes.
struct Lagrange {
    nodes: Vec<f64>,
    /// `1/Π_{m ≠ k} (t_k − t_m)`.
    factors: Vec<f64>,
}

impl Lagrange {
    fn of(count: usize) -> Self {
        let nodes: Vec<f64> = (0..count).map(|k| node(k, count)).collect();
        let factor = |k: usize| {
            let others = nodes.iter().enumerate().filter(|(m, _)| *m != k);
            1.0 / others.map(|(_, t)| nodes[k] - t).product::<f64>()
        };
        Self { factors: (0..count).map(factor).collect(), nodes }
    }

    /// Writes the value of each at t.
    fn fill(&self, t: f64, values: &mut [f64]) {
        let mut before = 1.0;
        for ((value, factor), node) in values.iter_mut().zip(&self.factors).zip(&self.nodes) {
            *value = factor * before;
            before *= t - node;
        }
        let mut behind = 1.0;
        for (value, node) in values.iter_mut().zip(&self.nodes).rev() {
            *value *= behind;
            behind *= t - node;
        }
    }
}

/// Chebyshev's node `k` of `count`.
fn node(k: usize, count: usize) -> f64 {
    (PI * (2 * k + 1) as f64 / (2 * count) as f64).cos()
}
