//! Flips of edges towards the Delaunay triangulation of the surface.

use super::EDGES_AT_ONCE;
use super::star::Triangulation;
use crate::error::Result;
use crate::machine::vector::{dot, norm};
use crate::observer::Observer;

/// Least cosine between the normals of the two triangles of a flipped edge, before and after.
const FLAT: f64 = 0.7;

/// Least gain, in the cosine sum, for a flip. Less would flip for rounding.
const LEAST_GAIN: f64 = 1e-9;

/// Sweeps over all edges. A sweep without a flip ends them.
const MAX_SWEEPS: usize = 20;

/// Flips edges whose opposite angles sum to more than 180°, until there are none.
///
/// # Errors
/// `NumericsError::Cancelled`.
pub fn flip(mesh: &mut Triangulation, observer: &dyn Observer) -> Result<()> {
    for _ in 0..MAX_SWEEPS {
        let mut n_flips = 0;
        for edges in mesh.edges().chunks(EDGES_AT_ONCE) {
            observer.checkpoint()?;
            for &[a, b] in edges {
                n_flips += usize::from(flip_edge(mesh, a, b));
            }
        }
        if n_flips == 0 {
            break;
        }
    }
    Ok(())
}

fn flip_edge(mesh: &mut Triangulation, a: u32, b: u32) -> bool {
    let beside = mesh.beside(a, b);
    let [first, second] = beside[..] else { return false };
    // The triangle in which a comes before b.
    let runs = |at: u32| {
        let [x, y, z] = mesh.triangles[at as usize];
        [(x, y), (y, z), (z, x)].contains(&(a, b))
    };
    let (left, right) = if runs(first) { (first, second) } else { (second, first) };
    let apex = |at: u32| mesh.triangles[at as usize].into_iter().find(|&v| v != a && v != b);
    let (Some(c), Some(d)) = (apex(left), apex(right)) else { return false };
    let ([cos_c, sin_c], [cos_d, sin_d]) = (mesh.angle(c, a, b), mesh.angle(d, a, b));
    // sin(γ + δ) < 0 where the angles sum to more than 180°.
    if sin_c * cos_d + cos_c * sin_d > -LEAST_GAIN || mesh.neighbours(c).contains(&d) {
        return false;
    }
    if mesh.star(a).len() <= 3 || mesh.star(b).len() <= 3 {
        return false;
    }
    let (new_left, new_right) = ([c, d, b], [d, c, a]);
    let old = [mesh.normal_of(mesh.triangles[left as usize]), mesh.normal_of(mesh.triangles[right as usize])];
    let new = [mesh.normal_of(new_left), mesh.normal_of(new_right)];
    let agree = |x: &[f64; 3], y: &[f64; 3]| dot(x, y) >= FLAT * norm(x) * norm(y) && norm(x) > 0.0;
    let mean = [0, 1, 2].map(|axis| old[0][axis] + old[1][axis]);
    if !new.iter().all(|normal| agree(normal, &mean)) {
        return false;
    }
    mesh.triangles[left as usize] = new_left;
    mesh.triangles[right as usize] = new_right;
    mesh.stars[a as usize].retain(|at| *at != left);
    mesh.stars[b as usize].retain(|at| *at != right);
    mesh.stars[c as usize].push(right);
    mesh.stars[d as usize].push(left);
    true
}
