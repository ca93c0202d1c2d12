//! A row of the sparse matrix: its weights and their origin.

use super::super::Operator;
use super::super::resolution::resolution;
use super::disc::{Disc, Site};
use crate::surface::flags::Resolution;

/// Origin of the weights of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RowKind {
    /// Smoothed polyharmonic splines on the nearest nodes.
    Nearest,
    /// Smoothed polyharmonic splines on nodes that are sparser the farther they are, where the nearest ones
    /// lie on one side.
    Graded,
    /// Weights of which none is negative except the diagonal.
    Positive,
    /// Least squares of the least norm, where the nodes do not determine derivatives.
    LeastNorm,
    /// No weights: there is no other node, or the query has no normal and is not stepped in time.
    #[default]
    Empty,
}

/// Weights of one query.
#[derive(Default)]
pub(super) struct Row {
    pub(super) columns: Vec<u32>,
    /// `[components, columns]`
    pub(super) weights: Vec<f64>,
    pub(super) resolution: Resolution,
    pub(super) kind: RowKind,
}

/// Weights over the scaled coordinates of a disc: `[n]` for the Laplacian, `[k, n]` for the gradient.
pub(super) struct Forms {
    pub(super) disc: Disc,
    pub(super) weights: Vec<f64>,
    pub(super) kind: RowKind,
}

impl Forms {
    /// Returns `−w_0/Σ|w_j|`, j ≠ 0. It is 1 for a row without negative weights beside the diagonal, and at
    /// most 0 for a diagonal of the wrong sign.
    pub(super) fn dominance(&self) -> f64 {
        let others: f64 = self.weights[1..].iter().map(|weight| weight.abs()).sum();
        -self.weights[0] / others
    }

    pub(super) fn into_row(self, site: &Site<'_>, operator: Operator) -> Row {
        let Self { disc, weights: forms, kind } = self;
        let (d, radius) = (disc.k + 1, disc.radius);
        let resolution = match kind {
            RowKind::Nearest | RowKind::Graded => {
                resolution(&forms, &disc.coordinates, disc.k, site.curvature * radius, operator)
            }
            // First order at best.
            RowKind::Positive | RowKind::LeastNorm | RowKind::Empty => Resolution::Unresolved,
        };
        let weights = match operator {
            Operator::LaplaceBeltrami => forms.iter().map(|w| w / (radius * radius)).collect(),
            Operator::SurfaceGradient => in_space(&forms, &site.axes, radius, d),
        };
        let row = Row { columns: disc.columns, weights, resolution, kind }.sorted(operator.n_components(d));
        if kind == RowKind::Positive { row.without_zeros() } else { row }
    }
}

impl Row {
    fn sorted(self, n_components: usize) -> Self {
        let n = self.columns.len();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_unstable_by_key(|&at| self.columns[at]);
        let columns = order.iter().map(|&at| self.columns[at]).collect();
        let weight = |component: usize| order.iter().map(move |&at| component * n + at);
        let weights = (0..n_components).flat_map(weight).map(|at| self.weights[at]).collect();
        Self { columns, weights, ..self }
    }

    /// Drops the entries that are 0, for one component.
    fn without_zeros(self) -> Self {
        let entries = self.columns.iter().zip(&self.weights).filter(|&(_, &weight)| weight != 0.0);
        let (columns, weights) = entries.map(|(&column, &weight)| (column, weight)).unzip();
        Self { columns, weights, ..self }
    }
}

/// Converts weights of the derivatives along the axes, `[k, n]`, to weights of the components in space,
/// `[d, n]`.
fn in_space(forms: &[f64], axes: &[f64], radius: f64, d: usize) -> Vec<f64> {
    let (k, n) = (d - 1, forms.len() / (d - 1));
    let component = |c: usize| {
        (0..n).map(move |j| (0..k).map(|a| forms[a * n + j] * axes[a * d + c]).sum::<f64>() / radius)
    };
    (0..d).flat_map(component).collect()
}
