//! Meshes of level sets: closed polylines in the plane and triangles in space.
//!
//! A lattice of nearly regular simplices is followed along the surface, each node evaluated once. Where an
//! edge of a simplex crosses the level, a root is found, and the simplices are cut there. So the mesh is a
//! manifold, and closed wherever the lattice does not end. [`level_set()`] does all of it.

mod closedness;
pub mod field;
pub mod fields;
mod lattice;
mod level_set;
mod parts;
mod places;
pub mod price;
mod regular;
mod support;
pub mod surface;

use rayon::prelude::*;

pub use closedness::{Closedness, DOUBTFUL, OPEN};
pub use lattice::follow::Bounds;
pub use level_set::{LevelSet, LevelSetRequest, Quality, Seeds, level_set};
pub use parts::Part;
pub use support::{Support, support};

/// A mesh of segments (d = 2) or triangles (d = 3).
///
/// Triangles run counter-clockwise seen from outside, and segments counter-clockwise around the inside.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    pub dimension: usize,
    /// `[k, d]`.
    pub vertices: Vec<f64>,
    /// Vertices of each cell, `[l, d]`.
    pub cells: Vec<u32>,
}

impl Mesh {
    pub fn n_vertices(&self) -> usize {
        self.vertices.len() / self.dimension
    }

    pub fn n_cells(&self) -> usize {
        self.cells.len() / self.dimension
    }

    pub fn vertex(&self, vertex: u32) -> &[f64] {
        &self.vertices[vertex as usize * self.dimension..][..self.dimension]
    }

    pub fn cells(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        self.cells.chunks_exact(self.dimension)
    }

    /// The cells for which `keeps` holds, with the vertices that they use.
    fn filtered(&self, keeps: impl Fn(&[u32]) -> bool) -> Self {
        let cells: Vec<u32> = self.cells().filter(|cell| keeps(cell)).flatten().copied().collect();
        let mut is_used = vec![false; self.n_vertices()];
        cells.iter().for_each(|&vertex| is_used[vertex as usize] = true);
        let mut place = vec![0; self.n_vertices()];
        let mut vertices = Vec::new();
        for vertex in (0..self.n_vertices()).filter(|&vertex| is_used[vertex]) {
            place[vertex] = (vertices.len() / self.dimension) as u32;
            vertices.extend(self.vertex(vertex as u32));
        }
        let cells = cells.iter().map(|&vertex| place[vertex as usize]).collect();
        Self { dimension: self.dimension, vertices, cells }
    }

    /// Labels vertices by connected region, counted in the order of their first vertices, `[k]`. Vertices of
    /// one cell are connected where `joins` says so.
    fn labels(&self, joins: impl Fn(u32, u32) -> bool) -> Vec<u32> {
        let mut parents: Vec<u32> = (0..self.n_vertices() as u32).collect();
        for cell in self.cells() {
            for (at, &a) in cell.iter().enumerate() {
                for &b in cell[at + 1..].iter().filter(|&&b| joins(a, b)) {
                    let (a, b) = (root(&mut parents, a), root(&mut parents, b));
                    parents[a.max(b) as usize] = a.min(b);
                }
            }
        }
        let mut labels = vec![0; parents.len()];
        let mut n_labels = 0;
        for vertex in 0..parents.len() {
            let first = root(&mut parents, vertex as u32) as usize;
            if first == vertex {
                labels[vertex] = n_labels;
                n_labels += 1;
            } else {
                labels[vertex] = labels[first];
            }
        }
        labels
    }

    /// The facets of all cells, sorted: edges of triangles, or ends of segments, by their vertices.
    fn facets(&self) -> Vec<[u32; 2]> {
        let mut facets: Vec<[u32; 2]> = match self.dimension {
            2 => self.cells.iter().map(|&vertex| [vertex, vertex]).collect(),
            _ => {
                let of_triangle = |cell: &[u32]| [[cell[0], cell[1]], [cell[1], cell[2]], [cell[2], cell[0]]];
                self.cells().flat_map(of_triangle).map(|[a, b]| [a.min(b), a.max(b)]).collect()
            }
        };
        facets.par_sort_unstable();
        facets
    }

    /// True for vertices on the boundary: those of a facet of a single cell, `[k]`.
    fn boundary(&self) -> Vec<bool> {
        let mut is_on_boundary = vec![false; self.n_vertices()];
        for same in self.facets().chunk_by(|a, b| a == b).filter(|same| same.len() == 1) {
            same[0].iter().for_each(|&vertex| is_on_boundary[vertex as usize] = true);
        }
        is_on_boundary
    }
}

/// The first vertex of a tree of a union-find forest. Paths are halved on the way.
fn root(parents: &mut [u32], mut vertex: u32) -> u32 {
    while parents[vertex as usize] != vertex {
        parents[vertex as usize] = parents[parents[vertex as usize] as usize];
        vertex = parents[vertex as usize];
    }
    vertex
}
