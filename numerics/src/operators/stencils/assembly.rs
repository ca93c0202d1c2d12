//! Assembly of the sparse rows of an operator, and the choice of weights for each row.

use rayon::prelude::*;

use super::super::Operator;
use super::disc::{Disc, Grading, Site};
use super::row::{Forms, Row, RowKind};
use super::sparse::SparseMatrix;
use super::{Stencils, least_norm, positive, radial};
use crate::error::{NumericsError, Result};
use crate::machine::eigen::symmetric_eigen;
use crate::machine::small::{Small, zeros};
use crate::observer::{Observer, Stage};
use crate::points::cloud::Cloud;
use crate::points::monomials::{MAX_STENCIL_DEGREE, NODES_PER_MONOMIAL, n_monomials, n_stencil_nodes};
use crate::points::neighbours::{Neighbour, Neighbours};
use crate::surface::geometry::Geometry;

/// Least degree of the polynomials: r⁵ is conditionally positive definite of order 3 (Wendland 2005, sec.
/// 8.3).
const LEAST_DEGREE: usize = 2;

/// Least dominance of the diagonal in a stable row. Eigenvalues with positive real part were seen to come
/// from rows below 0.1 (docs/numerics.md).
const DOMINANT: f64 = 0.2;

/// Graded discs: the nodes to choose from, as a multiple of those of a row, and the ratio of [`Grading`].
const GRADED: [(usize, f64); 2] = [(4, 0.35), (16, 0.5)];

/// The use that rows are made for.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Rows {
    /// Products with values: weights of the nearest nodes are the most accurate.
    Pointwise,
    /// Steps in time: the diagonal dominates.
    Stable,
}

/// An operator at queries over nodes.
pub(super) struct Assembly<'a> {
    pub(super) geometry: &'a Geometry,
    pub(super) nodes: &'a Cloud,
    pub(super) neighbours: &'a Neighbours,
    pub(super) queries: &'a Cloud,
    pub(super) operator: Operator,
    pub(super) rows: Rows,
}

impl Assembly<'_> {
    /// Computes the weights at all queries.
    ///
    /// # Errors
    /// [`NumericsError::DimensionMismatch`], [`NumericsError::Overflow`], [`NumericsError::Cancelled`].
    pub(super) fn stencils(&self, observer: &dyn Observer) -> Result<Stencils> {
        self.nodes.check_same_dimension(self.queries)?;
        observer.enter(Stage::Evaluate);
        let row = |found: &mut Vec<Neighbour>, query: usize| {
            observer.checkpoint()?;
            let row = self.row(query, found);
            if row.weights.iter().all(|weight| weight.is_finite()) {
                Ok(row)
            } else {
                Err(NumericsError::Overflow { query })
            }
        };
        let rows = (0..self.queries.n_points()).into_par_iter().map_init(Vec::new, row);
        let rows: Vec<Row> = rows.collect::<Result<_>>()?;
        let resolutions = rows.iter().map(|row| row.resolution).collect();
        let kinds = rows.iter().map(|row| row.kind).collect();
        let matrix = SparseMatrix::of(&rows, self.operator.n_components(self.nodes.dimension()));
        Ok(Stencils { matrix, resolutions, kinds })
    }

    /// Computes the row of a query.
    ///
    /// It is empty where no other node is on the query's sheet, and for a null query that is not stepped in
    /// time.
    fn row(&self, query: usize, found: &mut Vec<Neighbour>) -> Row {
        let x = self.queries.point(query);
        if self.geometry.is_null()[query] {
            return self.row_without_normal(x, found).unwrap_or_default();
        }
        let site = Site::new(x, self.geometry.normal(query), self.geometry.largest_curvature(query));
        let forms = self.forms(&site, found);
        forms.map(|forms| forms.into_row(&site, self.operator)).unwrap_or_default()
    }

    /// Computes positive weights at a node without a normal, over the plane nearest to the nodes around it.
    ///
    /// An empty row would keep the value at the node forever.
    fn row_without_normal(&self, x: &[f64], found: &mut Vec<Neighbour>) -> Option<Row> {
        let count = n_stencil_nodes(self.nodes.dimension());
        self.neighbours.nearest_positions_into(x, count, found);
        let normal = plane_normal(self.nodes, x, found)?;
        let site = Site::new(x, &normal, 0.0);
        let disc = Disc::nearest(self.nodes, &site, found, count)?;
        if !self.has_diagonal(&disc) {
            return None;
        }
        Some(positive_forms(vec![disc])?.into_row(&site, self.operator))
    }

    /// Computes the first acceptable weights: on the nearest nodes, on graded ones, or without splines.
    ///
    /// `found` is a buffer.
    fn forms(&self, site: &Site<'_>, found: &mut Vec<Neighbour>) -> Option<Forms> {
        let count = n_stencil_nodes(self.nodes.dimension());
        self.neighbours.nearest_positions_into(site.x, count + 1, found);
        let nearest = match self.splines(Disc::nearest(self.nodes, site, found, count)?, RowKind::Nearest) {
            Ok(forms) => return Some(forms),
            Err(disc) => disc,
        };
        let mut graded = Vec::new();
        for (times, ratio) in GRADED {
            self.neighbours.nearest_positions_into(site.x, times * count, found);
            let disc = Disc::graded(self.nodes, site, found, Grading { ratio, count })?;
            match self.splines(disc, RowKind::Graded) {
                Ok(forms) => return Some(forms),
                Err(disc) => graded.push(disc),
            }
        }
        if self.has_diagonal(&nearest) { positive_forms(graded) } else { Some(self.least_norm(nearest)) }
    }

    /// Returns whether a negative diagonal matters.
    fn has_diagonal(&self, disc: &Disc) -> bool {
        disc.is_at_node && self.rows == Rows::Stable
    }

    /// Computes weights by splines with the highest degree that the nodes determine.
    ///
    /// Returns the disc where there are none, or where the diagonal should dominate but does not.
    fn splines(&self, disc: Disc, kind: RowKind) -> Result<Forms, Disc> {
        let has_nodes = |&degree: &usize| {
            disc.n_nodes() as f64 >= (NODES_PER_MONOMIAL - 0.5) * n_monomials(disc.k, degree) as f64
        };
        let degrees = (LEAST_DEGREE..=MAX_STENCIL_DEGREE).rev().filter(has_nodes);
        let weights = degrees.into_iter().find_map(|degree| radial::weights(&disc, degree, self.operator));
        let Some(weights) = weights else { return Err(disc) };
        let forms = Forms { disc, weights, kind };
        let is_stable = !self.has_diagonal(&forms.disc) || forms.dominance() >= DOMINANT;
        if is_stable { Ok(forms) } else { Err(forms.disc) }
    }

    fn least_norm(&self, disc: Disc) -> Forms {
        let weights = least_norm::weights(&disc, self.operator);
        Forms { disc, weights, kind: RowKind::LeastNorm }
    }
}

/// Computes the normal of the plane through x with the least squared distances to the nodes.
fn plane_normal(nodes: &Cloud, x: &[f64], found: &[Neighbour]) -> Option<Small> {
    let d = x.len();
    let reach = found.last()?.squared_distance.sqrt();
    if !(reach > 0.0 && reach.is_finite()) {
        return None;
    }
    let mut moments = zeros(d * d);
    for node in found {
        let arm: Small = nodes.point(node.point).iter().zip(x).map(|(p, x)| (p - x) / reach).collect();
        for (at, moment) in moments.iter_mut().enumerate() {
            *moment += arm[at / d] * arm[at % d];
        }
    }
    let (_, vectors) = symmetric_eigen(&moments, d);
    Some(Small::from_slice(&vectors[..d]))
}

/// Computes positive weights on the narrowest disc that has exact ones, else on the narrowest disc.
///
/// `None` if there is no other node.
fn positive_forms(mut discs: Vec<Disc>) -> Option<Forms> {
    let found: Option<Vec<_>> = discs.iter().map(positive::weights).collect();
    let found = found?;
    let chosen = found.iter().position(|positive| positive.is_exact).unwrap_or(0);
    let weights = found.into_iter().nth(chosen)?.weights;
    let disc = discs.swap_remove(chosen);
    Some(Forms { disc, weights, kind: RowKind::Positive })
}
