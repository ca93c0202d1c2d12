//! Searches at one place after another.

use super::grid::is_on_grid;
use super::{Neighbour, Neighbours};
use crate::points::cloud::squared_distance;

/// Searches around places most of which are near the one before.
///
/// The positions around the last place bound how far those around the next one can be. So fewer are looked
/// at. What is found does not depend on the last place.
pub(crate) struct Walk<'a> {
    tree: &'a Neighbours,
    /// Positions around the last place, nearest first.
    found: Vec<Neighbour>,
}

impl<'a> Walk<'a> {
    pub(crate) fn over(tree: &'a Neighbours) -> Self {
        Self { tree, found: Vec::new() }
    }

    /// Finds the `count` nearest positions, nearest first, as indices for [`Neighbours::points_at`]. Indices
    /// of positions near each other are mostly near each other too.
    pub(crate) fn positions(&mut self, x: &[f64], count: usize) -> &[Neighbour] {
        let reach = self.reach(x, count);
        self.tree.search(x, count, reach, &mut self.found);
        &self.found
    }

    /// Writes the `count` nearest positions into `points`, each as its first point.
    pub(crate) fn points_into(&mut self, x: &[f64], count: usize, points: &mut Vec<Neighbour>) {
        points.clear();
        points.extend_from_slice(self.positions(x, count));
        self.tree.name_first_points(points);
    }

    /// Squared distance within which there are `count` positions, as a search from x computes distances. It
    /// moves x onto the grid first, as nearly every x is.
    fn reach(&self, x: &[f64], count: usize) -> f64 {
        if self.found.len() != count || !is_on_grid(x) {
            return f64::INFINITY;
        }
        let distance = |last: &Neighbour| squared_distance(x, self.tree.coordinates_of(last.point));
        self.found.iter().map(distance).fold(0.0, f64::max)
    }
}
