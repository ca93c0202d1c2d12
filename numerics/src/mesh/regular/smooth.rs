//! Smoothing of vertices along the surface.

use rayon::prelude::*;

use super::EDGES_AT_ONCE;
use super::star::Triangulation;
use crate::error::Result;
use crate::machine::vector::{dot, norm};
use crate::mesh::field::Field;
use crate::observer::Observer;

/// Least cosine between the normals of a triangle before and after its vertex has moved.
const TURN: f64 = 0.5;

/// Moves each vertex to the mean of its neighbours in its tangent plane.
///
/// # Errors
/// `NumericsError::Cancelled`.
pub fn smooth(mesh: &mut Triangulation, observer: &dyn Observer) -> Result<()> {
    let moving = moving(mesh);
    let mut wanted = Vec::with_capacity(moving.len());
    for vertices in moving.chunks(EDGES_AT_ONCE) {
        observer.checkpoint()?;
        wanted.par_extend(vertices.par_iter().map(|&vertex| tangential_mean(mesh, vertex)));
    }
    moving.iter().zip(wanted).for_each(|(&vertex, to)| move_to(mesh, vertex, to));
    Ok(())
}

/// Moves each vertex back onto the surface, by one step of Newton's method.
///
/// # Errors
/// Those of the field.
pub fn project(mesh: &mut Triangulation, field: &dyn Field, observer: &dyn Observer) -> Result<()> {
    let moving = moving(mesh);
    let places: Vec<[f64; 3]> = moving.iter().map(|&vertex| *mesh.position(vertex)).collect();
    let feet = field.feet(places.as_flattened(), observer)?.positions;
    for (&vertex, foot) in moving.iter().zip(feet.chunks_exact(3)) {
        move_to(mesh, vertex, [foot[0], foot[1], foot[2]]);
    }
    Ok(())
}

/// The vertices that are not on the boundary.
fn moving(mesh: &Triangulation) -> Vec<u32> {
    let n = mesh.stars.len() as u32;
    (0..n).filter(|&v| !mesh.is_fixed[v as usize] && !mesh.star(v).is_empty()).collect()
}

/// The mean of the neighbours of a vertex, weighted by the area of their triangles, in its tangent plane.
fn tangential_mean(mesh: &Triangulation, vertex: u32) -> [f64; 3] {
    let own = mesh.position(vertex);
    let (mut normal, mut sum, mut weights) = ([0.0; 3], [0.0; 3], 0.0);
    for &at in mesh.star(vertex) {
        let triangle = mesh.triangles[at as usize];
        let area = mesh.normal_of(triangle);
        let weight = norm(&area);
        weights += weight;
        for axis in 0..3 {
            normal[axis] += area[axis];
            let centre = triangle.iter().map(|&v| mesh.position(v)[axis]).sum::<f64>() / 3.0;
            sum[axis] += weight * (centre - own[axis]);
        }
    }
    let length = norm(&normal);
    if weights == 0.0 || length == 0.0 {
        return *own;
    }
    let step = sum.map(|s| s / weights);
    let along = dot(&step, &normal) / (length * length);
    [0, 1, 2].map(|axis| own[axis] + step[axis] - along * normal[axis])
}

/// Moves a vertex unless a triangle would turn over.
fn move_to(mesh: &mut Triangulation, vertex: u32, to: [f64; 3]) {
    let keeps = mesh.star(vertex).iter().map(|&at| mesh.triangles[at as usize]).all(|triangle| {
        let before = mesh.normal_of(triangle);
        let after =
            Triangulation::area_vector(triangle.map(|v| if v == vertex { &to } else { mesh.position(v) }));
        dot(&before, &after) >= TURN * norm(&before) * norm(&after) && norm(&after) > 0.0
    });
    if keeps {
        mesh.positions[vertex as usize] = to;
    }
}
