//! Following of the surface from cell to cell, in fronts, so that each node is evaluated once.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use rayon::prelude::*;

use super::nodes::{Lattice, Node, NodeHasher};
use crate::error::{NumericsError, Result};
use crate::mesh::field::Field;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::sampling::Sampling;

/// Values of f at nodes.
///
/// A node is found in constant time, so that a surface of many small fronts costs what its nodes do. Nothing
/// depends on the order of the table.
#[derive(Debug, Clone, Default)]
pub struct Samples(HashMap<Node, f64, BuildHasherDefault<NodeHasher>>);

/// Cells that the surface passes, sorted, and the values at all their corners.
pub struct SurfaceCells {
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
    /// Value at a node that was evaluated.
    pub fn value(&self, node: Node) -> f64 {
        self.0.get(&node).copied().unwrap_or(f64::NAN)
    }

    /// Values at the corners of a cell.
    pub fn corners(&self, cell: Node, n_corners: usize) -> [f64; 8] {
        let mut values = [f64::NAN; 8];
        (0..n_corners).for_each(|corner| values[corner] = self.value(cell.corner(corner)));
        values
    }
}

/// Cells of a front that are looked at together. Lists of their corners take some megabytes.
const CELLS_AT_ONCE: usize = 1 << 15;

/// Cells for which another thread is worth its while.
const CELLS_PER_THREAD: usize = 256;

/// Follows the surface from the sorted cells of `seeds`, at most to `max_nodes` nodes.
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
) -> Result<SurfaceCells> {
    let mut path = Path { field, region, max_nodes, samples: Samples::default(), cells: Vec::new() };
    let (mut last, mut front) = (Vec::new(), seeds);
    while !front.is_empty() {
        let mut next = Vec::new();
        for cells in front.chunks(CELLS_AT_ONCE) {
            let fronts = [last.as_slice(), front.as_slice()];
            next.append(&mut path.enter(cells, fronts, observer)?);
        }
        (last, front) = (front, sorted(next));
    }
    let Path { samples, mut cells, .. } = path;
    cells.par_sort_unstable();
    Ok(SurfaceCells { samples, cells })
}

/// A surface that is followed.
struct Path<'a> {
    field: &'a dyn Field,
    region: &'a Region<'a>,
    max_nodes: usize,
    samples: Samples,
    /// Cells that the surface passes.
    cells: Vec<Node>,
}

impl Path<'_> {
    /// Evaluates the corners of cells, and returns the cells beyond them that are in neither of the last two
    /// fronts.
    ///
    /// A face is crossed from both of its sides. So a cell that was entered earlier has no neighbour in the
    /// present front.
    fn enter(&mut self, cells: &[Node], fronts: [&[Node]; 2], observer: &dyn Observer) -> Result<Vec<Node>> {
        observer.checkpoint()?;
        self.evaluate(cells, observer)?;
        let n_corners = self.n_corners();
        let (samples, region) = (&self.samples, self.region);
        let with_values = |&cell: &Node| (cell, samples.corners(cell, n_corners));
        let crossed: Vec<(Node, [f64; 8])> = cells
            .par_iter()
            .with_min_len(CELLS_PER_THREAD)
            .map(with_values)
            .filter(|(_, values)| changes_sign(&values[..n_corners]))
            .collect();
        self.cells.extend(crossed.iter().map(|(cell, _)| *cell));
        let is_new = |cell: &Node| {
            fronts.iter().all(|front| front.binary_search(cell).is_err()) && region.contains(*cell)
        };
        let crossed = crossed.par_iter().with_min_len(CELLS_PER_THREAD);
        let next = crossed.flat_map_iter(|(cell, values)| beyond_crossed_faces(*cell, values, n_corners));
        Ok(sorted(next.filter(is_new).collect()))
    }

    /// Evaluates f at the corners of cells where it is not known.
    fn evaluate(&mut self, cells: &[Node], observer: &dyn Observer) -> Result<()> {
        let (n_corners, samples, lattice) = (self.n_corners(), &self.samples.0, self.region.lattice);
        let corners = cells.par_iter().with_min_len(CELLS_PER_THREAD);
        let corners = corners.flat_map_iter(|cell| (0..n_corners).map(|corner| cell.corner(corner)));
        let new = sorted(corners.filter(|node| !samples.contains_key(node)).collect());
        if samples.len() + new.len() > self.max_nodes {
            return Err(NumericsError::TooManyNodes { limit: self.max_nodes });
        }
        let places: Vec<f64> = new.iter().flat_map(|&node| lattice.position(node)).collect();
        let values = self.field.values(&places, observer)?;
        self.samples.0.extend(new.into_iter().zip(values));
        Ok(())
    }

    fn n_corners(&self) -> usize {
        1 << self.region.lattice.dimension()
    }
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

/// Sorts nodes, each once.
pub fn sorted(mut nodes: Vec<Node>) -> Vec<Node> {
    nodes.par_sort_unstable();
    nodes.dedup();
    nodes
}
