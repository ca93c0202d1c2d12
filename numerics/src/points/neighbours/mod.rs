//! Nearest neighbours in a cloud, by a k-d tree over its distinct positions.

mod build;
mod grid;
mod search;
#[cfg(test)]
mod tests;
mod walk;

use rayon::prelude::*;

use super::cloud::Cloud;
use crate::error::Result;
use crate::machine::heap::vec_bytes;
use crate::observer::Observer;

pub(crate) use grid::on_grid;
pub(crate) use walk::Walk;

/// Positions per leaf. Scanning 12 of them costs about as much as two more levels of descent.
const LEAF_SIZE: usize = 12;

/// A k-d tree over the positions of a cloud (Bentley 1975), any dimension.
///
/// Points with equal coordinates form one position, so repeated points do not slow a search down. Positions
/// whose squared distance underflows are merged as well: coordinates are rounded to multiples of 2⁻⁵¹¹
/// (grid.rs), which changes none above 1e-137. Two positions therefore never have the distance 0.
///
/// The tree is built in O(p log p) for p positions. Each split halves the widest coordinate near its median.
/// Ties of distance are broken by the smaller point index, so answers do not depend on the tree.
#[derive(Debug, Clone)]
pub struct Neighbours {
    dimension: usize,
    /// Coordinates of the positions, leaf by leaf, `[p, d]`.
    coordinates: Vec<f64>,
    /// Points of the cloud, position by position, ascending within a position, `[n]`.
    points: Vec<u32>,
    /// Start of each position within `points`, followed by the end of the last position, `[p + 1]`.
    starts: Vec<u32>,
    nodes: Vec<Node>,
}

#[derive(Debug, Clone, Copy)]
enum Node {
    /// A range of positions.
    Leaf { start: u32, end: u32 },
    /// Two children. The left child follows its parent, `right` is the index of the right one. Coordinates
    /// along `axis` are at most `below` on the left and at least `above` on the right.
    Split { axis: u32, right: u32, below: f64, above: f64 },
}

/// A neighbour and its squared distance (unit L²).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    pub point: usize,
    pub squared_distance: f64,
}

/// Distances from a position to its nearest others, unit L.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distances {
    pub nearest: f64,
    /// Mean over the neighbours asked for.
    pub mean: f64,
}

impl Neighbours {
    /// Builds the tree. It holds at most 2³² points, a number that no solver and no limit of the service
    /// reaches.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub fn of(cloud: &Cloud, observer: &dyn Observer) -> Result<Self> {
        build::tree(cloud, observer)
    }

    /// Number of distinct positions, p.
    pub fn n_positions(&self) -> usize {
        self.starts.len() - 1
    }

    /// Returns the points at a position, ascending.
    pub fn points_at(&self, position: usize) -> &[u32] {
        &self.points[self.starts[position] as usize..self.starts[position + 1] as usize]
    }

    /// The points in the order of the tree, `[n]`: position by position, ascending within a position.
    pub(crate) fn order(&self) -> &[u32] {
        &self.points
    }

    /// Rows `[n, width]` of the points in the order of the tree.
    pub(crate) fn rows_in_order<T: Copy>(&self, rows: &[T], width: usize) -> Vec<T> {
        let mut found = Vec::with_capacity(rows.len());
        self.points.iter().for_each(|&at| found.extend_from_slice(&rows[at as usize * width..][..width]));
        found
    }

    /// The same tree over the points in its order.
    pub(crate) fn in_own_order(&self) -> Self {
        Self { points: (0..self.points.len() as u32).collect(), ..self.clone() }
    }

    fn coordinates_of(&self, position: usize) -> &[f64] {
        &self.coordinates[position * self.dimension..][..self.dimension]
    }

    /// Returns the first point at a position, which represents all of them.
    fn first_point(&self, position: usize) -> usize {
        self.points[self.starts[position] as usize] as usize
    }

    /// Returns the `count` points nearest to `x`, nearest first, or all points if the cloud has fewer.
    pub fn nearest(&self, x: &[f64], count: usize) -> Vec<Neighbour> {
        let mut found = Vec::new();
        self.nearest_into(x, count, &mut found);
        found
    }

    /// Writes the result of [`Neighbours::nearest`] into an existing list.
    pub fn nearest_into(&self, x: &[f64], count: usize, found: &mut Vec<Neighbour>) {
        self.search(x, count, f64::INFINITY, found);
        if self.points.len() == self.n_positions() {
            self.name_first_points(found);
        } else {
            self.name_all_points(found, count);
        }
    }

    /// Returns which of some places are positions of the cloud, `[m]`.
    pub(crate) fn hold(&self, places: &Cloud) -> Vec<bool> {
        let is_held = |found: &mut Vec<Neighbour>, place: usize| {
            self.nearest_positions_into(places.point(place), 1, found);
            found.first().is_some_and(|nearest| nearest.squared_distance <= 0.0)
        };
        (0..places.n_points()).into_par_iter().map_init(Vec::new, is_held).collect()
    }

    /// Returns the `count` nearest positions, each as its first point, nearest first. Repeated observations
    /// count once.
    pub fn nearest_positions(&self, x: &[f64], count: usize) -> Vec<Neighbour> {
        let mut found = Vec::new();
        self.nearest_positions_into(x, count, &mut found);
        found
    }

    /// Writes the result of [`Neighbours::nearest_positions`] into an existing list.
    pub fn nearest_positions_into(&self, x: &[f64], count: usize, found: &mut Vec<Neighbour>) {
        self.search(x, count, f64::INFINITY, found);
        self.name_first_points(found);
    }

    /// Returns the distances from a position to its `count` nearest others, or `None` if there are none.
    /// `found` is scratch space.
    pub fn distances(&self, position: usize, count: usize, found: &mut Vec<Neighbour>) -> Option<Distances> {
        self.search(self.coordinates_of(position), count.saturating_add(1), f64::INFINITY, found);
        // The first entry is the position itself: no other has the distance 0.
        let others = found.get(1..)?;
        let distances = others.iter().map(|neighbour| neighbour.squared_distance.sqrt());
        let nearest = distances.clone().next()?;
        Some(Distances { nearest, mean: distances.sum::<f64>() / others.len() as f64 })
    }

    /// Replaces positions by their first points.
    fn name_first_points(&self, found: &mut [Neighbour]) {
        found.iter_mut().for_each(|neighbour| neighbour.point = self.first_point(neighbour.point));
    }

    /// Replaces positions, nearest first, by the `count` nearest of all their points.
    fn name_all_points(&self, found: &mut Vec<Neighbour>, count: usize) {
        let mut named: Vec<Neighbour> = Vec::with_capacity(count);
        for tied in found.chunk_by(|a, b| a.squared_distance == b.squared_distance) {
            let n_left = count - named.len();
            let n_nearer = named.len();
            for &Neighbour { point: position, squared_distance } in tied {
                let points = self.points_at(position).iter().take(n_left);
                named.extend(points.map(|&point| Neighbour { point: point as usize, squared_distance }));
            }
            named[n_nearer..].sort_unstable_by_key(|neighbour| neighbour.point);
            named.truncate(count);
        }
        *found = named;
    }

    /// Bytes held on the heap.
    pub fn n_bytes(&self) -> usize {
        vec_bytes(&self.coordinates)
            + vec_bytes(&self.points)
            + vec_bytes(&self.starts)
            + vec_bytes(&self.nodes)
    }
}
