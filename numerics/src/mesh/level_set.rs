//! The whole way from a field to its mesh.

use std::ops::Range;

use rayon::prelude::*;

use super::Mesh;
use super::field::{Feet, Field};
use super::lattice::cut::cut;
use super::lattice::follow::{Bounds, Region, follow, sorted};
use super::lattice::nodes::{Lattice, Node};
use super::lattice::roots::Crossings;
use super::parts::{Part, Parts};
use super::regular::regular;
use super::support::{Support, far, nearest_points, observed, support};
use crate::error::{NumericsError, Result};
use crate::observer::{Observer, Stage};
use crate::points::neighbours::Neighbour;
use crate::points::sampling::Sampling;

/// Shape of the triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quality {
    /// Nearly equilateral triangles with edges of about a step.
    Regular,
    /// The cut simplices themselves, with many slivers.
    Raw,
}

/// Places from which a surface is followed, `[s, d]`: those of the points of a range.
///
/// There may be hundreds for a point, so no more are made at once than for `SEEDING_POINTS`.
pub type Seeds<'a> = dyn Fn(Range<usize>, &dyn Observer) -> Result<Vec<f64>> + Sync + 'a;

/// Points whose seeds are made at once.
pub(super) const SEEDING_POINTS: usize = 1024;

/// A level set to mesh.
pub struct LevelSetRequest<'a> {
    pub field: &'a dyn Field,
    /// The points that support the surface.
    pub sampling: &'a Sampling,
    pub seeds: &'a Seeds<'a>,
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

impl LevelSet {
    /// Share of the vertices that are farther than three spacings from all points.
    pub fn share_far(&self) -> f64 {
        self.parts.iter().map(|part| part.n_far).sum::<usize>() as f64 / self.mesh.n_vertices().max(1) as f64
    }
}

/// Meshes the level set.
///
/// # Errors
/// Those of the field. `NumericsError::TooManyNodes` if the surface is too large for its step.
pub fn level_set(request: &LevelSetRequest<'_>, observer: &dyn Observer) -> Result<LevelSet> {
    observer.enter(Stage::Evaluate);
    let field = request.field;
    let raw = raw_mesh(request, observer)?;
    let (raw, parts, dropped) = without_specks(raw, request);
    let (mesh, quality) = match request.quality {
        Quality::Regular if raw.dimension == 3 => {
            let mesh = regular(&raw, field, request.step, observer)?;
            if topology(&Parts::of(&mesh).parts) == topology(&parts) {
                (mesh, Quality::Regular)
            } else {
                (raw, Quality::Raw)
            }
        }
        quality => (raw, quality),
    };
    let (mesh, feet) = settled(mesh, field, SETTLED * request.step, observer)?;
    let parts = Parts::of(&mesh).with_far(&far(&mesh, request.sampling));
    let support = support(&mesh, request.sampling);
    Ok(LevelSet { normals: feet.normals, residuals: feet.distances, support, parts, dropped, quality, mesh })
}

/// Newton steps after which vertices stay where they are: from the end of smoothing, two suffice.
const MAX_STEPS: usize = 6;

/// Part of a step up to which a vertex counts as on the surface.
const SETTLED: f64 = 1e-10;

/// Moves each vertex onto the surface, until it is as near as `enough`, L, or comes no nearer.
fn settled(mut mesh: Mesh, field: &dyn Field, enough: f64, observer: &dyn Observer) -> Result<(Mesh, Feet)> {
    let mut feet = field.feet(&mesh.vertices, observer)?;
    let d = mesh.dimension;
    let mut moving: Vec<usize> = (0..mesh.n_vertices()).collect();
    for _ in 0..MAX_STEPS {
        moving.retain(|&vertex| feet.distances[vertex] > enough);
        if moving.is_empty() {
            break;
        }
        let places: Vec<f64> =
            moving.iter().flat_map(|&vertex| &feet.positions[vertex * d..][..d]).copied().collect();
        let next = field.feet(&places, observer)?;
        let mut at = 0..moving.len();
        moving.retain(|&vertex| {
            let Some(at) = at.next().filter(|&at| next.distances[at] < feet.distances[vertex]) else {
                return false;
            };
            let (own, found) = (vertex * d..(vertex + 1) * d, at * d..(at + 1) * d);
            mesh.vertices[own.clone()].copy_from_slice(&feet.positions[own.clone()]);
            feet.positions[own.clone()].copy_from_slice(&next.positions[found.clone()]);
            feet.normals[own].copy_from_slice(&next.normals[found]);
            feet.distances[vertex] = next.distances[at];
            true
        });
    }
    Ok((mesh, feet))
}

/// Part of the difference of f along an edge of the lattice up to which a vertex counts as found. Newton's
/// steps with the gradient, which follow for all vertices, are then exact.
const PRECISION_OF_RAW: f64 = 1e-4;

/// The same for vertices that are moved along the surface and back onto it anyway.
const PRECISION_OF_REGULAR: f64 = 0.05;

fn raw_mesh(request: &LevelSetRequest<'_>, observer: &dyn Observer) -> Result<Mesh> {
    let (field, Bounds { min, max }) = (request.field, &request.bounds);
    let centre: Vec<f64> = min.iter().zip(max).map(|(a, b)| 0.5 * (a + b)).collect();
    let lattice = Lattice::new(&centre, request.step);
    let seeds = seed_cells(request, &lattice, observer)?;
    let rim = request.is_open.then_some(request.sampling);
    let region = Region { lattice: &lattice, bounds: &request.bounds, rim };
    let followed = follow(field, &region, seeds, request.max_nodes, observer)?;
    let crossings = Crossings::of(&followed, &lattice);
    let precision = match request.quality {
        Quality::Regular if field.dimension() == 3 => PRECISION_OF_REGULAR,
        Quality::Regular | Quality::Raw => PRECISION_OF_RAW,
    };
    let vertices = crossings.roots(field, precision, observer)?;
    let cells = cut(&followed, &lattice, &crossings.edges);
    Ok(Mesh { dimension: field.dimension(), vertices, cells })
}

/// Finds the cells of the seeds, sorted.
fn seed_cells(
    request: &LevelSetRequest<'_>,
    lattice: &Lattice,
    observer: &dyn Observer,
) -> Result<Vec<Node>> {
    let LevelSetRequest { field, sampling, bounds, max_nodes, .. } = request;
    // A step so short that the lattice does not reach a point is refused like one with too many nodes.
    let too_many = NumericsError::TooManyNodes { limit: *max_nodes };
    let n_points = sampling.spacings().len();
    let mut cells = Vec::new();
    for first in (0..n_points).step_by(SEEDING_POINTS) {
        observer.checkpoint()?;
        let places = (request.seeds)(first..n_points.min(first + SEEDING_POINTS), observer)?;
        let within = places.chunks_exact(field.dimension()).filter(|x| bounds.contains(x));
        let found = within.map(|x| lattice.cell(x)).collect::<Option<Vec<_>>>();
        cells.append(&mut sorted(found.ok_or(too_many.clone())?));
        if cells.len() > 2 * max_nodes {
            cells = sorted(cells);
            // Each cell has a first corner of its own.
            if cells.len() > *max_nodes {
                return Err(too_many);
            }
        }
    }
    Ok(sorted(cells))
}

/// Least size of a part over d, in spacings to the power d − 1. Smaller ones have fewer points than determine
/// a surface.
const LEAST_SIZE: f64 = 2.0;

/// Least number of points of its own of a part for its size, over that of the whole mesh. Bubbles beside a
/// surface, or between sheets that nearly touch, have a quarter.
const LEAST_OWN: f64 = 0.5;

/// Leaves out parts that are too small to mean anything, or that have no points of their own near them.
/// Returns what is left, with its parts, and what was left out.
fn without_specks(mesh: Mesh, request: &LevelSetRequest<'_>) -> (Mesh, Vec<Part>, Vec<Part>) {
    let least = LEAST_SIZE
        * mesh.dimension as f64
        * request.sampling.scales().spacing.powi(mesh.dimension as i32 - 1);
    let Parts { parts, of_vertex } = Parts::of(&mesh);
    let mut is_kept = supported(&mesh, &parts, &of_vertex, request.sampling);
    is_kept.iter_mut().zip(&parts).for_each(|(is_kept, part)| *is_kept &= part.area >= least);
    let mut kept = is_kept.iter();
    let (kept, dropped): (Vec<Part>, Vec<Part>) = parts.iter().partition(|_| kept.next() == Some(&true));
    if dropped.is_empty() {
        return (mesh, kept, dropped);
    }
    (mesh.filtered(|cell| is_kept[of_vertex[cell[0] as usize] as usize]), kept, dropped)
}

/// A vertex of a part, with the point nearest to it.
struct Claim {
    point: usize,
    part: usize,
    squared_distance: f64,
}

/// True for each part that has enough points of its own, `[n_parts]`: points to which it is the nearest part.
fn supported(mesh: &Mesh, parts: &[Part], part_of: &[u32], sampling: &Sampling) -> Vec<bool> {
    let nearest = nearest_points(mesh, sampling);
    let n_own = own_points(&nearest, part_of, parts.len());
    // Areas in units of the spacings around them.
    let mut sizes = vec![0.0; parts.len()];
    for (near, &part) in nearest.iter().zip(part_of) {
        let Part { area, n_vertices, .. } = parts[part as usize];
        let unit = sampling.spacing(near.point).powi(mesh.dimension as i32 - 1);
        sizes[part as usize] += area / n_vertices as f64 / unit;
    }
    let share = n_own.iter().sum::<f64>() / sizes.iter().sum::<f64>();
    let is_observed = observed(&nearest, sampling);
    let mut is_near = vec![false; parts.len()];
    part_of.iter().zip(is_observed).for_each(|(&part, is)| is_near[part as usize] |= is);
    let has_own = |part: usize| n_own[part] >= LEAST_OWN * share * sizes[part];
    (0..parts.len()).map(|part| is_near[part] && has_own(part)).collect()
}

/// Counts the points that are nearer to a part than to the others, `[n_parts]`, of those that are nearest to
/// some vertex.
fn own_points(nearest: &[Neighbour], part_of: &[u32], n_parts: usize) -> Vec<f64> {
    let of_vertex = |(near, &part): (&Neighbour, &u32)| Claim {
        point: near.point,
        part: part as usize,
        squared_distance: near.squared_distance,
    };
    let mut claims: Vec<Claim> = nearest.iter().zip(part_of).map(of_vertex).collect();
    claims.par_sort_unstable_by(|a, b| {
        let by_distance = a.squared_distance.total_cmp(&b.squared_distance);
        a.point.cmp(&b.point).then(by_distance).then(a.part.cmp(&b.part))
    });
    claims.dedup_by_key(|claim| claim.point);
    let mut n_own = vec![0.0; n_parts];
    claims.iter().for_each(|claim| n_own[claim.part] += 1.0);
    n_own
}

/// The Euler characteristic of each part, and whether it is closed, sorted.
fn topology(parts: &[Part]) -> Vec<(i64, bool)> {
    let of = |part: &Part| (part.euler_characteristic, part.n_boundary_edges == 0);
    let mut found: Vec<(i64, bool)> = parts.iter().map(of).collect();
    found.sort_unstable();
    found
}
