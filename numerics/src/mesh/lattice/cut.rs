//! Simplices cut by the level: their segments and triangles.

use rayon::prelude::*;

use super::follow::{SurfaceCells, is_inside};
use super::nodes::{Corner, Edge, Lattice, Node};

/// Cuts all cells. Returns the segments (d = 2) or triangles (d = 3) by their vertices, `[l, d]`: the
/// positions of their edges among the sorted `edges`.
///
/// Triangles run counter-clockwise seen from outside. Segments have the outside on their right.
pub fn cut(followed: &SurfaceCells, lattice: &Lattice, edges: &[Edge]) -> Vec<u32> {
    let n_corners = 1 << lattice.dimension();
    let of_cell = |cell: &Node| {
        let values = followed.samples.corners(*cell, n_corners);
        let mut found = Vec::new();
        for simplex in lattice.simplices() {
            for (from, to) in cut_edges(simplex, &values) {
                let edge = Edge::of(*cell, from, to);
                found.push(edges.binary_search(&edge).unwrap_or_default() as u32);
            }
        }
        found
    };
    followed.cells.par_iter().flat_map_iter(of_cell).collect()
}

/// The edges of a simplex that its segment, or its one or two triangles, have as vertices, in their order.
fn cut_edges(simplex: &[Corner], values: &[f64; 8]) -> Vec<(Corner, Corner)> {
    let inside: Vec<bool> = simplex.iter().map(|&corner| is_inside(values[corner])).collect();
    let places: &[[usize; 2]] = match inside[..] {
        [a, b, c] => of_triangle([a, b, c]),
        [a, b, c, d] => of_tetrahedron([a, b, c, d]),
        _ => &[],
    };
    places.iter().map(|&[from, to]| (simplex[from], simplex[to])).collect()
}

/// The two edges of a positively oriented triangle that a segment joins.
fn of_triangle(inside: [bool; 3]) -> &'static [[usize; 2]] {
    match inside {
        [false, false, false] | [true, true, true] => &[],
        [true, false, false] => &[[0, 1], [0, 2]],
        [false, true, true] => &[[0, 2], [0, 1]],
        [false, true, false] => &[[1, 2], [1, 0]],
        [true, false, true] => &[[1, 0], [1, 2]],
        [false, false, true] => &[[2, 0], [2, 1]],
        [true, true, false] => &[[2, 1], [2, 0]],
    }
}

/// The edges of a positively oriented tetrahedron that the triangles of a cut have as vertices.
fn of_tetrahedron(inside: [bool; 4]) -> &'static [[usize; 2]] {
    match inside {
        [false, false, false, false] | [true, true, true, true] => &[],
        // One corner inside: in an even order (i, j, k, l) the triangle (ij, ik, il) faces away from i.
        [true, false, false, false] => &[[0, 1], [0, 2], [0, 3]],
        [false, true, false, false] => &[[1, 0], [1, 3], [1, 2]],
        [false, false, true, false] => &[[2, 0], [2, 1], [2, 3]],
        [false, false, false, true] => &[[3, 0], [3, 2], [3, 1]],
        // One corner outside: the same triangles, turned over.
        [false, true, true, true] => &[[0, 1], [0, 3], [0, 2]],
        [true, false, true, true] => &[[1, 0], [1, 2], [1, 3]],
        [true, true, false, true] => &[[2, 0], [2, 3], [2, 1]],
        [true, true, true, false] => &[[3, 0], [3, 1], [3, 2]],
        // Two corners i, j inside: the quadrilateral (ik, il, jl, jk) in an even order (i, j, k, l).
        [true, true, false, false] => &[[0, 2], [0, 3], [1, 3], [0, 2], [1, 3], [1, 2]],
        [true, false, true, false] => &[[0, 3], [0, 1], [2, 1], [0, 3], [2, 1], [2, 3]],
        [true, false, false, true] => &[[0, 1], [0, 2], [3, 2], [0, 1], [3, 2], [3, 1]],
        [false, true, true, false] => &[[1, 0], [1, 3], [2, 3], [1, 0], [2, 3], [2, 0]],
        [false, true, false, true] => &[[1, 2], [1, 0], [3, 0], [1, 2], [3, 0], [3, 2]],
        [false, false, true, true] => &[[2, 0], [2, 1], [3, 1], [2, 0], [3, 1], [3, 0]],
    }
}
