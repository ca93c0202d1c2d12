//! Flips of edges towards the Delaunay triangulation of the surface.

use rayon::prelude::*;

use super::EDGES_AT_ONCE;
use super::star::Triangulation;
use crate::error::Result;
use crate::machine::vector::{dot, norm};
use crate::observer::Observer;

/// Least cosine between the normals of the two triangles of a flipped edge, before and after.
const FLAT: f64 = 0.7;

/// Least gain, in the cosine sum, for a flip. Less would flip for rounding.
const LEAST_GAIN: f64 = 1e-9;

/// Sweeps over the edges: first over all, then over those around flipped ones. A sweep without a flip ends
/// them.
const MAX_SWEEPS: usize = 20;

/// Flips edges whose opposite angles sum to more than 180°, until there are none.
///
/// # Errors
/// `NumericsError::Cancelled`.
pub fn flip(mesh: &mut Triangulation, observer: &dyn Observer) -> Result<()> {
    let mut edges = mesh.edges();
    for _ in 0..MAX_SWEEPS {
        let mut gains = Vec::new();
        for edges in edges.chunks(EDGES_AT_ONCE) {
            observer.checkpoint()?;
            gains.par_extend(edges.par_iter().copied().filter(|&edge| Flip::of(mesh, edge).is_some()));
        }
        let mut around = Vec::new();
        for edges in gains.chunks(EDGES_AT_ONCE) {
            observer.checkpoint()?;
            for &edge in edges {
                // An earlier flip may have changed what is best here.
                if let Some(flip) = Flip::of(mesh, edge) {
                    around.extend(flip.around(edge));
                    flip.apply(mesh, edge);
                }
            }
        }
        if around.is_empty() {
            break;
        }
        around.sort_unstable();
        around.dedup();
        edges = around;
    }
    Ok(())
}

/// A flip that is allowed and a gain.
struct Flip {
    /// The triangle in which the first end of the edge comes before the second, and the other one.
    left: u32,
    right: u32,
    /// Their third vertices, which the new edge joins.
    c: u32,
    d: u32,
}

impl Flip {
    fn of(mesh: &Triangulation, [a, b]: [u32; 2]) -> Option<Self> {
        let beside = mesh.beside(a, b);
        let [first, second] = beside[..] else { return None };
        let runs = |at: u32| {
            let [x, y, z] = mesh.triangles[at as usize];
            [(x, y), (y, z), (z, x)].contains(&(a, b))
        };
        let (left, right) = if runs(first) { (first, second) } else { (second, first) };
        let apex = |at: u32| mesh.triangles[at as usize].into_iter().find(|&v| v != a && v != b);
        let found = Self { left, right, c: apex(left)?, d: apex(right)? };
        (found.is_gain(mesh, [a, b]) && found.is_allowed(mesh, [a, b])).then_some(found)
    }

    fn is_gain(&self, mesh: &Triangulation, [a, b]: [u32; 2]) -> bool {
        let ([cos_c, sin_c], [cos_d, sin_d]) = (mesh.angle(self.c, a, b), mesh.angle(self.d, a, b));
        // sin(γ + δ) < 0 where the angles sum to more than 180°.
        sin_c * cos_d + cos_c * sin_d <= -LEAST_GAIN
    }

    /// Whether the edge is not there already, no vertex loses too many triangles, and the surface is flat
    /// here.
    fn is_allowed(&self, mesh: &Triangulation, [a, b]: [u32; 2]) -> bool {
        if mesh.star(a).len() <= 3 || mesh.star(b).len() <= 3 || mesh.neighbours(self.c).contains(&self.d) {
            return false;
        }
        let old = [self.left, self.right].map(|at| mesh.normal_of(mesh.triangles[at as usize]));
        let new = self.triangles([a, b]).map(|triangle| mesh.normal_of(triangle));
        let agree = |x: &[f64; 3], y: &[f64; 3]| dot(x, y) >= FLAT * norm(x) * norm(y) && norm(x) > 0.0;
        let mean = [0, 1, 2].map(|axis| old[0][axis] + old[1][axis]);
        new.iter().all(|normal| agree(normal, &mean))
    }

    /// The new triangles.
    fn triangles(&self, [a, b]: [u32; 2]) -> [[u32; 3]; 2] {
        [[self.c, self.d, b], [self.d, self.c, a]]
    }

    /// The four edges around, whose best flips may be others afterwards.
    fn around(&self, [a, b]: [u32; 2]) -> [[u32; 2]; 4] {
        let Self { c, d, .. } = *self;
        [[a, c], [a, d], [b, c], [b, d]].map(|[x, y]| [x.min(y), x.max(y)])
    }

    fn apply(&self, mesh: &mut Triangulation, [a, b]: [u32; 2]) {
        let Self { left, right, c, d } = *self;
        let [new_left, new_right] = self.triangles([a, b]);
        mesh.triangles[left as usize] = new_left;
        mesh.triangles[right as usize] = new_right;
        mesh.stars[a as usize].retain(|at| *at != left);
        mesh.stars[b as usize].retain(|at| *at != right);
        mesh.stars[c as usize].push(right);
        mesh.stars[d as usize].push(left);
    }
}
