//! Support of the vertices of a mesh: points, a bridge over a gap between them, or nothing.

use rayon::prelude::*;

use super::Mesh;
use crate::points::neighbours::Neighbour;
use crate::points::sampling::Sampling;

/// Distance to the nearest point, in spacings there, up to which a vertex is observed.
const OBSERVED: f64 = 2.0;

/// Distance to the nearest point, in spacings there, up to which a gap is bridged. Farther away the surface
/// is a guess.
const BRIDGED: f64 = 8.0;

/// Distance to the nearest point, in spacings there, from which a vertex is far from all points.
const FAR: f64 = 3.0;

/// Support of a vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Support {
    /// There are points within two spacings.
    Observed,
    /// The cloud has a hole here, with points all around.
    Bridged,
    /// The surface goes on beyond the points, or far from them.
    Extrapolated,
}

/// Finds the point nearest to each vertex, `[k]`.
pub(super) fn nearest_points(mesh: &Mesh, sampling: &Sampling) -> Vec<Neighbour> {
    let rows = mesh.vertices.par_chunks_exact(mesh.dimension);
    let nearest = |found: &mut Vec<Neighbour>, x: &[f64]| {
        sampling.neighbours().nearest_positions_into(x, 1, found);
        found.first().copied()
    };
    // A cloud has at least one point.
    rows.map_init(Vec::new, nearest).flatten_iter().collect()
}

/// True for each vertex that has points near it, `[k]`.
pub(super) fn observed(nearest: &[Neighbour], sampling: &Sampling) -> Vec<bool> {
    nearest.iter().map(|near| spacings(near, sampling) <= OBSERVED).collect()
}

/// True for each vertex that is far from all points, `[k]`.
pub(super) fn far(mesh: &Mesh, sampling: &Sampling) -> Vec<bool> {
    nearest_points(mesh, sampling).iter().map(|near| spacings(near, sampling) > FAR).collect()
}

/// The distance of a vertex from its nearest point, in spacings there.
fn spacings(near: &Neighbour, sampling: &Sampling) -> f64 {
    near.squared_distance.sqrt() / sampling.spacing(near.point)
}

/// Finds the support of each vertex, `[k]`. A connected region without points is bridged or extrapolated as a
/// whole.
pub fn support(mesh: &Mesh, sampling: &Sampling) -> Vec<Support> {
    let nearest = nearest_points(mesh, sampling);
    let is_observed = observed(&nearest, sampling);
    let region = mesh.labels(|a, b| !is_observed[a as usize] && !is_observed[b as usize]);
    let is_on_boundary = mesh.boundary();
    let mut is_beyond = vec![false; mesh.n_vertices()];
    for (vertex, near) in nearest.iter().enumerate() {
        is_beyond[region[vertex] as usize] |= spacings(near, sampling) > BRIDGED || is_on_boundary[vertex];
    }
    let of_vertex = |vertex: usize| match (is_observed[vertex], is_beyond[region[vertex] as usize]) {
        (true, _) => Support::Observed,
        (false, false) => Support::Bridged,
        (false, true) => Support::Extrapolated,
    };
    (0..mesh.n_vertices()).map(of_vertex).collect()
}
