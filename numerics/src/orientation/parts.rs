//! A cloud divided into disjoint parts.

use super::edges::{Edge, edges_of};
use super::forest::Membership;

/// Agreement above which an edge is sure: the surface leads from one of its points to the other.
const SURE: f64 = 0.5;

/// The points of a cloud, part by part.
pub(super) struct Parts {
    /// The part of each point, `[n]`.
    pub of_point: Vec<usize>,
    /// The points of each part. Parts are in the order of their first points.
    pub members: Vec<Vec<usize>>,
}

impl Parts {
    /// Makes a part of the points with each root.
    pub(super) fn of(found: &[Membership]) -> Self {
        let mut part_of_root = vec![usize::MAX; found.len()];
        let mut members: Vec<Vec<usize>> = Vec::new();
        let mut of_point = Vec::with_capacity(found.len());
        for (point, &Membership { root, .. }) in found.iter().enumerate() {
            if part_of_root[root] == usize::MAX {
                part_of_root[root] = members.len();
                members.push(Vec::new());
            }
            of_point.push(part_of_root[root]);
            members[part_of_root[root]].push(point);
        }
        Self { of_point, members }
    }

    /// Grows patches of at most `most` points, each from its first point along sure edges that agree with the
    /// signs of their ends.
    ///
    /// `edges` are ordered by first point.
    pub(super) fn along_sure(edges: &[Edge], signs: &[f64], most: usize) -> Self {
        let mut patches = Self { of_point: vec![usize::MAX; signs.len()], members: Vec::new() };
        for first in 0..signs.len() {
            if patches.of_point[first] != usize::MAX {
                continue;
            }
            patches.of_point[first] = patches.members.len();
            let (mut patch, mut at) = (vec![first], 0);
            while let Some(&point) = patch.get(at) {
                for edge in edges_of(edges, point) {
                    let is_free = patches.of_point[edge.b()] == usize::MAX;
                    if is_free && patch.len() < most && edge.agreement(signs) > SURE {
                        patches.of_point[edge.b()] = patches.members.len();
                        patch.push(edge.b());
                    }
                }
                at += 1;
            }
            patches.members.push(patch);
        }
        patches
    }

    /// Returns the points of some parts.
    pub(super) fn points_of(&self, parts: &[usize]) -> impl Iterator<Item = usize> {
        parts.iter().flat_map(|&part| &self.members[part]).copied()
    }

    /// Flips the signs of the points of some parts.
    pub(super) fn turn(&self, turned: &[usize], signs: &mut [f64]) {
        self.points_of(turned).for_each(|point| signs[point] = -signs[point]);
    }

    /// Returns the share of the points of each part for which `is_such` holds for the magnitude of the
    /// misfit. `misfits` are `[n]`.
    pub(super) fn shares(&self, misfits: &[f64], is_such: impl Fn(f64) -> bool) -> Vec<f64> {
        let share = |points: &Vec<usize>| {
            let count = points.iter().filter(|&&point| is_such(misfits[point].abs())).count();
            count as f64 / points.len() as f64
        };
        self.members.iter().map(share).collect()
    }

    /// Returns all parts, largest first.
    pub(super) fn by_size(&self) -> Vec<usize> {
        let mut parts: Vec<usize> = (0..self.members.len()).collect();
        parts.sort_by_key(|&part| (usize::MAX - self.members[part].len(), part));
        parts
    }
}
