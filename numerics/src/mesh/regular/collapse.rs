//! Collapse of short edges.

use rayon::prelude::*;

use super::EDGES_AT_ONCE;
use super::star::Triangulation;
use crate::error::Result;
use crate::machine::vector::{dot, norm};
use crate::observer::Observer;

/// Part of the wanted length below which an edge collapses.
const SHORT: f64 = 0.8;

/// Part of the wanted length that no edge may exceed through a collapse.
const LONG: f64 = 4.0 / 3.0;

/// Least cosine between the normals of a triangle before and after a collapse.
const TURN: f64 = 0.5;

/// Least number of triangles at a vertex.
const LEAST_STAR: usize = 4;

/// Classes of length in which edges collapse. Within a class they follow in the order of memory, in which
/// neighbours are near each other.
const N_CLASSES: f64 = 4.0;

/// Collapses short edges, those of the shortest class first, each into its middle.
///
/// # Errors
/// `NumericsError::Cancelled`.
pub fn collapse(mesh: &mut Triangulation, length: f64, observer: &dyn Observer) -> Result<()> {
    let class = |[a, b]: [u32; 2]| N_CLASSES * mesh.squared_length(a, b).sqrt() / (SHORT * length);
    let classed = mesh.edges().into_par_iter().map(|edge| (class(edge), edge));
    let mut edges: Vec<(u8, [u32; 2])> =
        classed.filter(|(class, _)| *class < N_CLASSES).map(|(class, edge)| (class as u8, edge)).collect();
    edges.par_sort_unstable();
    let mut has_moved = vec![false; mesh.positions.len()];
    for (at, (_, [a, b])) in edges.into_iter().enumerate() {
        if at % EDGES_AT_ONCE == 0 {
            observer.checkpoint()?;
        }
        // The ends of an edge of which one has moved are judged again in the next round.
        if has_moved[a as usize]
            || has_moved[b as usize]
            || mesh.is_fixed[a as usize]
            || mesh.is_fixed[b as usize]
        {
            continue;
        }
        let [x, y] = [a, b].map(|end| *mesh.position(end));
        let middle = [0, 1, 2].map(|axis| 0.5 * (x[axis] + y[axis]));
        if may_collapse(mesh, [a, b], &middle, length) {
            merge(mesh, [a, b], middle);
            has_moved[a as usize] = true;
        }
    }
    Ok(())
}

/// Whether the link condition holds, no edge becomes long, and no triangle turns over.
fn may_collapse(mesh: &Triangulation, [a, b]: [u32; 2], to: &[f64; 3], length: f64) -> bool {
    let beside = mesh.beside(a, b);
    if beside.len() != 2 {
        return false;
    }
    let (around_a, around_b) = (mesh.neighbours(a), mesh.neighbours(b));
    let common: Vec<u32> = around_a.iter().copied().filter(|v| around_b.binary_search(v).is_ok()).collect();
    if common.len() != 2 || around_a.len() + around_b.len() < LEAST_STAR + 4 {
        return false;
    }
    if common.iter().any(|&v| mesh.star(v).len() <= LEAST_STAR) {
        return false;
    }
    let is_long = |&v: &u32| {
        let x = mesh.position(v);
        (0..3).map(|axis| (x[axis] - to[axis]).powi(2)).sum::<f64>() > (LONG * length).powi(2)
    };
    if around_a.iter().chain(&around_b).filter(|&&v| v != a && v != b).any(is_long) {
        return false;
    }
    let changed = mesh.star(a).iter().chain(mesh.star(b)).filter(|at| !beside.contains(at));
    changed.map(|&at| mesh.triangles[at as usize]).all(|triangle| {
        let before = mesh.normal_of(triangle);
        let place = |vertex: u32| if vertex == a || vertex == b { to } else { mesh.position(vertex) };
        let after = Triangulation::area_vector(triangle.map(place));
        dot(&before, &after) >= TURN * norm(&before) * norm(&after) && norm(&after) > 0.0
    })
}

/// Merges b into a.
fn merge(mesh: &mut Triangulation, [a, b]: [u32; 2], to: [f64; 3]) {
    for at in mesh.beside(a, b) {
        mesh.remove(at);
    }
    for at in std::mem::take(&mut mesh.stars[b as usize]) {
        mesh.triangles[at as usize].iter_mut().filter(|vertex| **vertex == b).for_each(|vertex| *vertex = a);
        mesh.stars[a as usize].push(at);
    }
    mesh.positions[a as usize] = to;
}
