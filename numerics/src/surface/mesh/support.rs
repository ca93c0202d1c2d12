//! What the vertices of a mesh rest on: points, a bridge over a gap between them, or nothing.

use rayon::prelude::*;

use super::Mesh;
use crate::points::sampling::Sampling;

/// Distance to the nearest point, in spacings there, up to which a vertex is observed.
const OBSERVED: f64 = 2.0;

/// Distance to the nearest point, in spacings there, up to which a gap is bridged. Farther away the surface
/// is a guess.
const BRIDGED: f64 = 8.0;

/// What a vertex rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Support {
    /// There are points within two spacings.
    Observed,
    /// The cloud has a hole here, with points all around.
    Bridged,
    /// The surface goes on beyond the points, or far from them.
    Extrapolated,
}

/// Finds the support of each vertex, `[k]`. A connected region without points is bridged or extrapolated as a
/// whole.
pub fn support(mesh: &Mesh, sampling: &Sampling) -> Vec<Support> {
    let distances: Vec<f64> = mesh
        .vertices
        .par_chunks_exact(mesh.dimension)
        .map_init(Vec::new, |found, x| {
            sampling.neighbours().nearest_positions_into(x, 1, found);
            found
                .first()
                .map_or(f64::INFINITY, |near| near.squared_distance.sqrt() / sampling.spacing(near.point))
        })
        .collect();
    let is_observed = |vertex: u32| distances[vertex as usize] <= OBSERVED;
    let region = mesh.labels(|a, b| !is_observed(a) && !is_observed(b));
    let is_on_boundary = mesh.boundary();
    let mut is_beyond = vec![false; mesh.n_vertices()];
    for vertex in 0..mesh.n_vertices() {
        is_beyond[region[vertex] as usize] |= distances[vertex] > BRIDGED || is_on_boundary[vertex];
    }
    let of_vertex = |vertex: usize| match (is_observed(vertex as u32), is_beyond[region[vertex] as usize]) {
        (true, _) => Support::Observed,
        (false, false) => Support::Bridged,
        (false, true) => Support::Extrapolated,
    };
    (0..mesh.n_vertices()).map(of_vertex).collect()
}
