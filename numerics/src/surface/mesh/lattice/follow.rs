//! Following of the surface from cell to cell, in fronts, so that each node is evaluated once.

use rayon::prelude::*;

use super::nodes::{Lattice, Node};
use crate::error::{NumericsError, Result};
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::sampling::Sampling;
use crate::surface::mesh::field::Field;

/// Values of f at nodes, sorted by node.
#[derive(Debug, Clone, Default)]
pub struct Samples {
    nodes: Vec<Node>,
    values: Vec<f64>,
}

/// Cells that the surface passes, sorted, and the values at all their corners.
pub struct Followed {
    pub samples: Samples,
    pub cells: Vec<Node>,
}

/// Part of space that a surface is followed in. It ends with a boundary where the region ends.
pub struct Region<'a> {
    pub lattice: &'a Lattice,
    pub bounds: &'a Bounds,
    /// Points that an open surface ends with.
    pub rim: Option<&'a Sampling>,
}

/// Distance, in spacings, to which an open surface is followed from its points.
const REACH: f64 = 1.5;

impl Region<'_> {
    fn contains(&self, cell: Node) -> bool {
        if !self.lattice.holds(cell) {
            return false;
        }
        let place = self.lattice.position(cell);
        self.bounds.contains(&place) && self.rim.is_none_or(|points| is_near(points, &place))
    }
}

fn is_near(points: &Sampling, place: &[f64]) -> bool {
    let nearest = points.neighbours().nearest(place, 1);
    nearest.first().is_some_and(|near| near.squared_distance <= (REACH * points.spacing(near.point)).powi(2))
}

/// A box, `[d]` each.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    pub min: Vec<f64>,
    pub max: Vec<f64>,
}

impl Bounds {
    /// The box of a cloud and `margin` around it, L.
    pub fn around(cloud: &Cloud, margin: f64) -> Self {
        let (min, max) = cloud.bounding_box();
        let moved = |of: Vec<f64>, by: f64| of.into_iter().map(|x| x + by).collect();
        Self { min: moved(min, -margin), max: moved(max, margin) }
    }

    /// Whether a place is in the box.
    pub fn contains(&self, x: &[f64]) -> bool {
        x.iter().zip(&self.min).zip(&self.max).all(|((x, min), max)| min <= x && x <= max)
    }
}

impl Samples {
    pub fn n_nodes(&self) -> usize {
        self.nodes.len()
    }

    /// Value at a node that was evaluated.
    pub fn value(&self, node: Node) -> f64 {
        self.nodes.binary_search(&node).map_or(f64::NAN, |at| self.values[at])
    }

    /// Values at the corners of a cell.
    pub fn corners(&self, cell: Node, n_corners: usize) -> [f64; 8] {
        let mut values = [f64::NAN; 8];
        (0..n_corners).for_each(|corner| values[corner] = self.value(cell.corner(corner)));
        values
    }

    fn contains(&self, node: Node) -> bool {
        self.nodes.binary_search(&node).is_ok()
    }

    /// Adds sorted nodes that are not in the list.
    fn merge(&mut self, nodes: &[Node], values: &[f64]) {
        let n = self.nodes.len() + nodes.len();
        let (mut all_nodes, mut all_values) = (Vec::with_capacity(n), Vec::with_capacity(n));
        let (mut a, mut b) = (0, 0);
        while a < self.nodes.len() || b < nodes.len() {
            let takes_old = b == nodes.len() || a < self.nodes.len() && self.nodes[a] < nodes[b];
            if takes_old {
                all_nodes.push(self.nodes[a]);
                all_values.push(self.values[a]);
                a += 1;
            } else {
                all_nodes.push(nodes[b]);
                all_values.push(values[b]);
                b += 1;
            }
        }
        (self.nodes, self.values) = (all_nodes, all_values);
    }
}

/// Follows the surface from the cells of `seeds`, at most to `max_nodes` nodes.
///
/// A neighbouring cell is entered through a face whose corners differ in sign. So the surface is followed as
/// far as it is connected, and parts of it that no seed is on are not found.
///
/// # Errors
/// Those of the field. `NumericsError::TooManyNodes`.
pub fn follow(
    field: &dyn Field,
    region: &Region<'_>,
    seeds: Vec<Node>,
    max_nodes: usize,
    observer: &dyn Observer,
) -> Result<Followed> {
    let lattice = region.lattice;
    let n_corners = 1 << lattice.dimension();
    let mut samples = Samples::default();
    let (mut visited, mut front): (Vec<Node>, Vec<Node>) = (Vec::new(), sorted(seeds));
    let mut cells = Vec::new();
    while !front.is_empty() {
        let corners = front.par_iter().flat_map_iter(|cell| (0..n_corners).map(|corner| cell.corner(corner)));
        let new = sorted(corners.filter(|node| !samples.contains(*node)).collect());
        if samples.n_nodes() + new.len() > max_nodes {
            return Err(NumericsError::TooManyNodes { limit: max_nodes });
        }
        observer.checkpoint()?;
        let places: Vec<f64> = new.par_iter().flat_map_iter(|&node| lattice.position(node)).collect();
        let values = field.values(&places, observer)?;
        samples.merge(&new, &values);
        let crossed: Vec<(Node, [f64; 8])> = front
            .par_iter()
            .map(|&cell| (cell, samples.corners(cell, n_corners)))
            .filter(|(_, values)| changes_sign(&values[..n_corners]))
            .collect();
        cells.extend(crossed.iter().map(|(cell, _)| *cell));
        visited = union(&visited, &front);
        let next =
            crossed.par_iter().flat_map_iter(|(cell, values)| beyond_crossed_faces(*cell, values, n_corners));
        let is_new = |cell: &Node| visited.binary_search(cell).is_err() && region.contains(*cell);
        front = sorted(next.filter(is_new).collect());
    }
    cells.par_sort_unstable();
    Ok(Followed { samples, cells })
}

/// Whether a value is inside.
pub fn is_inside(value: f64) -> bool {
    value >= 0.0
}

fn changes_sign(values: &[f64]) -> bool {
    values.iter().any(|&value| is_inside(value)) && values.iter().any(|&value| !is_inside(value))
}

/// Cells on the other sides of the faces whose corners differ in sign.
fn beyond_crossed_faces(cell: Node, values: &[f64; 8], n_corners: usize) -> impl Iterator<Item = Node> {
    let values = *values;
    let axes = (0..3).map(|axis| 1 << axis).filter(move |&axis| axis < n_corners);
    axes.flat_map(move |axis| {
        let side = move |is_far: bool| {
            let corners = (0..n_corners).filter(move |corner| (corner & axis != 0) == is_far);
            let n_inside = corners.filter(|&corner| is_inside(values[corner])).count();
            n_inside > 0 && n_inside < n_corners / 2
        };
        let near = side(false).then(|| cell.before(axis));
        let far = side(true).then(|| cell.corner(axis));
        near.into_iter().chain(far)
    })
}

fn sorted(mut nodes: Vec<Node>) -> Vec<Node> {
    nodes.par_sort_unstable();
    nodes.dedup();
    nodes
}

/// The union of two sorted lists without common entries.
fn union(a: &[Node], b: &[Node]) -> Vec<Node> {
    let mut all = [a, b].concat();
    // Two sorted runs: the stable sort merges them.
    all.sort();
    all
}
