//! Search for the nearest positions in the k-d tree.

use super::grid::{is_on_grid, on_grid};
use super::{Neighbour, Neighbours, Node};
use crate::machine::small::{Small, zeros};
use crate::points::cloud::squared_distance;

struct Search<'a> {
    tree: &'a Neighbours,
    x: &'a [f64],
    count: usize,
    /// Distance from x to the current cell along each axis (Arya and Mount 1993).
    offsets: Small,
    /// Squared distance of the farthest position that can still be among the nearest.
    reach: f64,
    /// Positions found so far, nearest first.
    found: &'a mut Vec<Neighbour>,
}

impl Neighbours {
    /// Finds the `count` nearest positions as indices in the tree, nearest first, and writes them into
    /// `found`. There must be as many within `reach`, a squared distance as it is computed from x.
    pub(super) fn search(&self, x: &[f64], count: usize, reach: f64, found: &mut Vec<Neighbour>) {
        found.clear();
        if count == 0 {
            return;
        }
        let moved: Small;
        let x = if is_on_grid(x) {
            x
        } else {
            moved = x.iter().map(|&x| on_grid(x)).collect();
            &moved
        };
        let offsets = zeros(self.dimension);
        let mut search = Search { tree: self, x, count, offsets, reach, found };
        match self.dimension {
            2 => search.visit::<2>(0),
            3 => search.visit::<3>(0),
            _ => search.visit::<0>(0),
        }
    }
}

impl Search<'_> {
    /// Visits a node. D is the dimension if it is known at compile time, else 0.
    fn visit<const D: usize>(&mut self, node: usize) {
        match self.tree.nodes[node] {
            Node::Leaf { start, end } => self.scan::<D>(start as usize, end as usize),
            Node::Split { axis, right, below, above } => {
                let (axis, right) = (axis as usize, right as usize);
                let x = self.x[axis];
                // Both parts are closed intervals, and x may lie between them.
                if x - below < above - x {
                    self.visit::<D>(node + 1);
                    self.visit_far::<D>(right, axis, above - x);
                } else {
                    self.visit::<D>(right);
                    self.visit_far::<D>(node + 1, axis, x - below);
                }
            }
        }
    }

    /// Visits the child on the side where x is not, unless it is too far.
    fn visit_far<const D: usize>(&mut self, node: usize, axis: usize, offset: f64) {
        let before = std::mem::replace(&mut self.offsets[axis], offset);
        if self.squared_distance_of_cell::<D>() <= self.reach {
            self.visit::<D>(node);
        }
        self.offsets[axis] = before;
    }

    fn scan<const D: usize>(&mut self, start: usize, end: usize) {
        let d = if D == 0 { self.x.len() } else { D };
        let tree = self.tree;
        let coordinates = tree.coordinates[start * d..end * d].chunks_exact(d);
        for (position, y) in (start..end).zip(coordinates) {
            let squared_distance = squared_distance(&self.x[..d], &y[..d]);
            self.offer(Neighbour { point: position, squared_distance });
        }
    }

    /// Squared distance from x to the current cell. It never exceeds the computed distance of a position in
    /// the cell, not even by rounding: rounding is monotonic, and the terms are added in the same order.
    fn squared_distance_of_cell<const D: usize>(&self) -> f64 {
        let d = if D == 0 { self.offsets.len() } else { D };
        self.offsets[..d].iter().map(|offset| offset * offset).sum()
    }

    #[inline]
    fn offer(&mut self, candidate: Neighbour) {
        if candidate.squared_distance > self.reach {
            return;
        }
        let place = self.found.partition_point(|found| !self.is_before(&candidate, found));
        if place == self.count {
            return;
        }
        self.found.truncate(self.count - 1);
        self.found.insert(place, candidate);
        if self.found.len() == self.count {
            self.reach = self.found[self.count - 1].squared_distance;
        }
    }

    /// Returns whether position a comes before b: it is nearer, or as near with an earlier first point.
    #[inline]
    fn is_before(&self, a: &Neighbour, b: &Neighbour) -> bool {
        let first = |position: &Neighbour| self.tree.first_point(position.point);
        a.squared_distance < b.squared_distance
            || (a.squared_distance == b.squared_distance && first(a) < first(b))
    }
}
