//! The whole way from a field to its mesh.

use super::Mesh;
use super::field::{Feet, Field};
use super::lattice::cut::cut;
use super::lattice::follow::{Bounds, Region, follow};
use super::lattice::nodes::Lattice;
use super::lattice::roots::{crossed_edges, roots};
use super::parts::{Part, Parts};
use super::regular::regular;
use super::support::{Support, support};
use crate::error::{NumericsError, Result};
use crate::observer::{Observer, Stage};
use crate::points::sampling::Sampling;

/// Shape of the triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quality {
    /// Nearly equilateral triangles with edges of about a step.
    Regular,
    /// The cut simplices themselves, with many slivers.
    Raw,
}

/// A level set to mesh.
pub struct LevelSetRequest<'a> {
    pub field: &'a dyn Field,
    /// The points that support the surface.
    pub sampling: &'a Sampling,
    /// Places from which the surface is followed, `[s, d]`.
    pub seeds: Vec<f64>,
    /// Longest edge of the lattice, L.
    pub step: f64,
    /// Box that the surface is followed in.
    pub bounds: Bounds,
    /// True for a surface that ends where its points end.
    pub is_open: bool,
    pub quality: Quality,
    /// Bound on the nodes of the lattice that are evaluated.
    pub max_nodes: usize,
}

/// A mesh with what is known of its vertices.
#[derive(Debug, Clone)]
pub struct LevelSet {
    pub mesh: Mesh,
    /// Outward unit normals, `[k, d]`.
    pub normals: Vec<f64>,
    /// Distances of the vertices from the level, to first order, `[k]`, L.
    pub residuals: Vec<f64>,
    pub support: Vec<Support>,
    /// Parts of the mesh, largest first.
    pub parts: Vec<Part>,
    /// Parts without a point near them, which were left out.
    pub dropped: Vec<Part>,
    /// The quality of the triangles. Raw where regular ones would have had another topology.
    pub quality: Quality,
}

/// Meshes the level set.
///
/// # Errors
/// Those of the field. `NumericsError::TooManyNodes` if the surface is too large for its step.
pub fn level_set(request: &LevelSetRequest<'_>, observer: &dyn Observer) -> Result<LevelSet> {
    observer.enter(Stage::Evaluate);
    let field = request.field;
    let raw = raw_mesh(request, observer)?;
    let (raw, dropped) = without_specks(raw, request);
    let (mesh, quality) = match request.quality {
        Quality::Regular if raw.dimension == 3 => {
            let mesh = regular(&raw, field, request.step, observer)?;
            if has_topology_of(&mesh, &raw) { (mesh, Quality::Regular) } else { (raw, Quality::Raw) }
        }
        quality => (raw, quality),
    };
    let (mesh, feet) = settled(mesh, field, SETTLED * request.step, observer)?;
    let parts = Parts::of(&mesh).parts;
    let support = support(&mesh, request.sampling);
    Ok(LevelSet { normals: feet.normals, residuals: feet.distances, support, parts, dropped, quality, mesh })
}

/// Newton steps after which vertices stay where they are: from the end of smoothing, two suffice.
const MAX_STEPS: usize = 6;

/// Part of a step up to which a vertex counts as on the surface.
const SETTLED: f64 = 1e-10;

/// Moves the vertices onto the surface, until all are as near as `enough`, L, or come no nearer.
fn settled(mut mesh: Mesh, field: &dyn Field, enough: f64, observer: &dyn Observer) -> Result<(Mesh, Feet)> {
    let mut feet = field.feet(&mesh.vertices, observer)?;
    let d = mesh.dimension;
    for _ in 0..MAX_STEPS {
        let worst = feet.distances.iter().copied().fold(0.0, f64::max);
        if worst <= enough {
            break;
        }
        let next = field.feet(&feet.positions, observer)?;
        let mut has_moved = false;
        for vertex in 0..mesh.n_vertices() {
            if next.distances[vertex] >= feet.distances[vertex] {
                continue;
            }
            let range = vertex * d..(vertex + 1) * d;
            mesh.vertices[range.clone()].copy_from_slice(&feet.positions[range.clone()]);
            feet.positions[range.clone()].copy_from_slice(&next.positions[range.clone()]);
            feet.normals[range.clone()].copy_from_slice(&next.normals[range]);
            feet.distances[vertex] = next.distances[vertex];
            has_moved = true;
        }
        if !has_moved {
            break;
        }
    }
    Ok((mesh, feet))
}

fn raw_mesh(request: &LevelSetRequest<'_>, observer: &dyn Observer) -> Result<Mesh> {
    let (field, Bounds { min, max }) = (request.field, &request.bounds);
    let centre: Vec<f64> = min.iter().zip(max).map(|(a, b)| 0.5 * (a + b)).collect();
    let lattice = Lattice::new(&centre, request.step);
    let seeds = request.seeds.chunks_exact(field.dimension()).filter(|x| request.bounds.contains(x));
    // A step so short that the lattice does not reach a point is refused like one with too many nodes.
    let too_short = NumericsError::TooManyNodes { limit: request.max_nodes };
    let seeds = seeds.map(|x| lattice.cell(x)).collect::<Option<Vec<_>>>().ok_or(too_short)?;
    let rim = request.is_open.then_some(request.sampling);
    let region = Region { lattice: &lattice, bounds: &request.bounds, rim };
    let followed = follow(field, &region, seeds, request.max_nodes, observer)?;
    let edges = crossed_edges(&followed, &lattice);
    let vertices = roots(field, &lattice, &followed, &edges, observer)?;
    let cells = cut(&followed, &lattice, &edges);
    Ok(Mesh { dimension: field.dimension(), vertices, cells })
}

/// Least size of a part over d, in spacings to the power d − 1. Smaller ones have fewer points than determine
/// a surface.
const LEAST_SIZE: f64 = 2.0;

/// Leaves out parts that no point is near to, or that are too small to mean anything. Returns them too.
fn without_specks(mesh: Mesh, request: &LevelSetRequest<'_>) -> (Mesh, Vec<Part>) {
    let sampling = request.sampling;
    let least =
        LEAST_SIZE * mesh.dimension as f64 * sampling.scales().spacing.powi(mesh.dimension as i32 - 1);
    let Parts { parts, of_vertex } = Parts::of(&mesh);
    let mut is_supported = vec![false; parts.len()];
    for (&part, support) in of_vertex.iter().zip(support(&mesh, sampling)) {
        is_supported[part as usize] |= support == Support::Observed;
    }
    is_supported.iter_mut().zip(&parts).for_each(|(is_supported, part)| *is_supported &= part.area >= least);
    let dropped: Vec<Part> = parts
        .iter()
        .zip(&is_supported)
        .filter(|(_, supported)| !**supported)
        .map(|(part, _)| *part)
        .collect();
    if dropped.is_empty() {
        return (mesh, dropped);
    }
    (mesh.filtered(|cell| is_supported[of_vertex[cell[0] as usize] as usize]), dropped)
}

/// Whether two meshes have equally many parts, each with the same Euler characteristic and both closed or
/// not.
fn has_topology_of(mesh: &Mesh, other: &Mesh) -> bool {
    let of = |mesh: &Mesh| {
        let parts = Parts::of(mesh).parts;
        let mut of: Vec<(i64, bool)> =
            parts.iter().map(|part| (part.euler_characteristic, part.n_boundary_edges == 0)).collect();
        of.sort_unstable();
        of
    };
    of(mesh) == of(other)
}
