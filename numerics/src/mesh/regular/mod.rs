//! Regular triangles: short edges collapsed, others flipped, vertices spread over the surface.
//!
//! Every operation keeps the topology: an edge collapses only under the link condition (Dey, Edelsbrunner,
//! Guha and Nekhayev, "Topology preserving edge contraction", 1999) and if no triangle turns over.

mod collapse;
mod flip;
mod smooth;
mod star;

use super::Mesh;
use super::field::Field;
use crate::error::Result;
use crate::observer::Observer;
use star::Triangulation;

/// Rounds of collapse, flips and smoothing.
const ROUNDS: usize = 3;

/// Smoothing steps of a round.
const SMOOTHINGS: usize = 2;

/// Edges or vertices looked at between two looks at whether the work is cancelled.
const EDGES_AT_ONCE: usize = 1 << 14;

/// Makes the triangles of a mesh (d = 3) regular, with edges about as long as `length`. Vertices stay on the
/// surface of the field.
///
/// # Errors
/// Those of the field.
pub fn regular(mesh: &Mesh, field: &dyn Field, length: f64, observer: &dyn Observer) -> Result<Mesh> {
    let mut triangles = Triangulation::of(mesh);
    for _ in 0..ROUNDS {
        collapse::collapse(&mut triangles, length, observer)?;
        flip::flip(&mut triangles, observer)?;
        for _ in 0..SMOOTHINGS {
            smooth::smooth(&mut triangles, observer)?;
            flip::flip(&mut triangles, observer)?;
        }
        smooth::project(&mut triangles, field, observer)?;
    }
    Ok(triangles.into_mesh())
}
