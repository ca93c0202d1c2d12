//! A cloud as disjoint parts.

use super::edges::Edge;
use super::forest::{Found, SignedForest};

/// Weight from which an edge cannot be cut: the surface leads from one of its points to the other.
const SURE: f64 = 0.5;

/// The points of a cloud, part by part.
pub(super) struct Parts {
    /// The part of each point, `[n]`.
    pub of_point: Vec<usize>,
    /// The points of each part, ascending; parts in the order of their first points.
    pub members: Vec<Vec<usize>>,
}

impl Parts {
    /// Points with the same root.
    pub(super) fn of(found: &[Found]) -> Self {
        let mut part_of_root = vec![usize::MAX; found.len()];
        let mut members: Vec<Vec<usize>> = Vec::new();
        let mut of_point = Vec::with_capacity(found.len());
        for (point, &Found { root, .. }) in found.iter().enumerate() {
            if part_of_root[root] == usize::MAX {
                part_of_root[root] = members.len();
                members.push(Vec::new());
            }
            of_point.push(part_of_root[root]);
            members[part_of_root[root]].push(point);
        }
        Self { of_point, members }
    }

    /// Points that edges join which are sure and do not contradict the signs of their ends.
    pub(super) fn along_sure(edges: &[Edge], signs: &[f64]) -> Self {
        let mut forest = SignedForest::new(signs.len());
        for edge in edges.iter().filter(|edge| edge.agreement(signs) > SURE) {
            forest.join(edge.a, edge.b, 1.0);
        }
        Self::of(&forest.find_all())
    }

    /// All parts, largest first.
    pub(super) fn by_size(&self) -> Vec<usize> {
        let mut parts: Vec<usize> = (0..self.members.len()).collect();
        parts.sort_by_key(|&part| (usize::MAX - self.members[part].len(), part));
        parts
    }
}
