//! Nodes around a query, in its tangent plane.

use crate::machine::small::Small;
use crate::machine::vector::{dot, norm, tangent_basis};
use crate::points::cloud::Cloud;
use crate::points::neighbours::Neighbour;

/// Slope beyond which a node is on another sheet.
const STEEP: f64 = 1.0;

/// Relative difference up to which two distances, or their squares, are equal: a rotation changes them less.
const TIED: f64 = 1e-9;

/// A query on the surface.
pub(super) struct Site<'a> {
    pub(super) x: &'a [f64],
    pub(super) normal: &'a [f64],
    /// Orthonormal basis of the tangent plane, `[k, d]` with k = d − 1.
    pub(super) axes: Small,
    /// Magnitude of the largest principal curvature, 1/L.
    pub(super) curvature: f64,
}

impl<'a> Site<'a> {
    pub(super) fn new(x: &'a [f64], normal: &'a [f64], curvature: f64) -> Self {
        Self { x, normal, axes: tangent_basis(normal), curvature }
    }

    /// Returns the coordinates of a node in the tangent plane, unit L, or `None` if the node is on another
    /// sheet.
    fn project(&self, node: &[f64], squared_distance: f64) -> Option<Small> {
        let arm: Small = node.iter().zip(self.x).map(|(p, x)| p - x).collect();
        let local: Small = self.axes.chunks_exact(arm.len()).map(|axis| dot(axis, &arm)).collect();
        let is_on_sheet = dot(self.normal, &arm).abs() <= STEEP * norm(&local);
        (is_on_sheet || squared_distance == 0.0).then_some(local)
    }
}

/// Nodes around a query in its tangent plane, nearest first.
pub(super) struct Disc {
    /// Indices of the nodes, `[n]`.
    pub(super) columns: Vec<u32>,
    /// Tangential coordinates in units of `radius`, `[n, k]`.
    pub(super) coordinates: Vec<f64>,
    pub(super) k: usize,
    /// Distance of the farthest node within the tangent plane, unit L.
    pub(super) radius: f64,
    /// True if the query is the first node.
    pub(super) is_at_node: bool,
}

impl Disc {
    /// Selects the `count` nearest nodes on the query's sheet, without those that are as far as the next one.
    /// So the order of the points does not decide between ties.
    ///
    /// `found` is sorted by distance and has `count + 1` entries. `None` if all nodes are at the query.
    pub(super) fn nearest(nodes: &Cloud, site: &Site<'_>, found: &[Neighbour], count: usize) -> Option<Self> {
        let tied = match found.get(count) {
            Some(next) => next.squared_distance * (1.0 - TIED),
            None => f64::INFINITY,
        };
        let n_nearer = found.partition_point(|node| node.squared_distance < tied);
        // If all nodes lie on a sphere around the query, all of them are ties.
        let kept = if n_nearer > count / 2 { n_nearer } else { count };
        Self::of(nodes, site, &found[..kept.min(found.len())], |_, _| true)
    }

    /// Selects nodes whose mutual distances grow with the distance r from the query.
    ///
    /// Nearest first, each node is taken that has no chosen one within `ratio · r`. Such a disc reaches
    /// across a jump of the density, where all of the nearest nodes lie on one side.
    pub(super) fn graded(
        nodes: &Cloud,
        site: &Site<'_>,
        found: &[Neighbour],
        grading: Grading,
    ) -> Option<Self> {
        let Grading { ratio, count } = grading;
        Self::of(nodes, site, found, |chosen, local| {
            let (k, r) = (local.len(), norm(local));
            // Equally far nodes do not exclude each other, so that their order does not decide.
            let allows =
                |other: &[f64]| norm(other) >= r * (1.0 - TIED) || distance(other, local) >= ratio * r;
            chosen.len() < count * k && chosen.chunks_exact(k).all(allows)
        })
    }

    /// Selects the nodes for which `accepts` is true, given the coordinates of the chosen nodes and of the
    /// node itself.
    fn of(
        nodes: &Cloud,
        site: &Site<'_>,
        found: &[Neighbour],
        accepts: impl Fn(&[f64], &[f64]) -> bool,
    ) -> Option<Self> {
        let k = site.x.len() - 1;
        let (mut columns, mut coordinates) = (Vec::new(), Vec::new());
        for node in found {
            let Some(local) = site.project(nodes.point(node.point), node.squared_distance) else { continue };
            if accepts(&coordinates, &local) {
                columns.push(node.point as u32);
                coordinates.extend_from_slice(&local);
            }
        }
        let radius = coordinates.chunks_exact(k).map(norm).fold(0.0, f64::max);
        if radius <= 0.0 {
            return None;
        }
        coordinates.iter_mut().for_each(|t| *t /= radius);
        let is_at_node = found.first().is_some_and(|node| node.squared_distance == 0.0);
        Some(Self { columns, coordinates, k, radius, is_at_node })
    }

    pub(super) fn n_nodes(&self) -> usize {
        self.columns.len()
    }

    pub(super) fn point(&self, node: usize) -> &[f64] {
        &self.coordinates[node * self.k..][..self.k]
    }
}

/// Options of a graded disc.
#[derive(Clone, Copy)]
pub(super) struct Grading {
    /// Least distance of a node from nearer ones, over its distance from the query.
    pub(super) ratio: f64,
    /// Largest number of nodes.
    pub(super) count: usize,
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}
