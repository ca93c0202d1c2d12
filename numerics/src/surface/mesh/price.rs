//! Price of a mesh, from the number of points and the step alone.

use super::Quality;
use crate::machine::price::Price;

/// Area of a surface over n h₄², for points spread evenly. For d = 2, length over n h₄. It is 1 for a square
/// lattice of points, and 0.86 for random ones.
const AREA_PER_POINT: f64 = 1.0;

/// Size of a surface, over the expected one, up to which it is followed. Points that are spread unevenly lie
/// on larger surfaces than their median spacing says.
const MAX_EXCESS: f64 = 3.0;

/// Nodes that are always allowed: a few cells hold a small surface, whatever its points say.
const LEAST_NODES: usize = 4096;

/// Counts for a surface of one step to the power d − 1. Those of space were measured on tori. In the plane,
/// vertices were measured on circles (2.26 to 2.36), and nodes are an estimate.
struct Counts {
    nodes: f64,
    raw_vertices: f64,
    regular_vertices: f64,
}

const PLANE: Counts = Counts { nodes: 3.6, raw_vertices: 2.3, regular_vertices: 2.3 };
const SPACE: Counts = Counts { nodes: 5.3, raw_vertices: 6.4, regular_vertices: 1.3 };

/// Evaluations of f for a raw vertex, until its root is found, and for one that is moved afterwards anyway.
const ROUNDS: f64 = 4.0;
const ROUNDS_OF_REGULAR: f64 = 1.5;

/// Gradients of f for a vertex of a regular mesh: after three rounds of smoothing on meshes that shrink, and
/// in the last steps of Newton's method.
const SMOOTHINGS: f64 = 7.0;

/// Bytes for a raw vertex with its two triangles, edges and stars, and for a node with its cell.
const BYTES_PER_VERTEX: f64 = 320.0;
const BYTES_PER_NODE: f64 = 80.0;

/// Flops of a raw vertex beside its evaluations: cells, cuts, its nearest point, and regular triangles.
const FLOPS_PER_VERTEX: f64 = 2e4;

/// Flops of one evaluation of the field of local regressions: its nearest points, their quadrics, and where
/// these do not agree, a winding number.
pub(crate) const LOCAL_EVALUATION: f64 = 2e4;

/// Extent of a mesh that is to be made.
#[derive(Debug, Clone, Copy)]
pub struct MeshSize {
    pub n_points: usize,
    pub dimension: usize,
    /// Step in median spacings of the points.
    pub step: f64,
    pub quality: Quality,
}

impl MeshSize {
    fn counts(self) -> Counts {
        if self.dimension == 2 { PLANE } else { SPACE }
    }

    /// Expected size of the surface in steps to the power d − 1.
    fn extent(self) -> f64 {
        AREA_PER_POINT * self.n_points as f64 / self.step.powi(self.dimension as i32 - 1)
    }

    /// Expected number of vertices.
    pub fn n_vertices(self) -> usize {
        let counts = self.counts();
        let each = match self.quality {
            Quality::Raw => counts.raw_vertices,
            Quality::Regular => counts.regular_vertices,
        };
        (each * self.extent()).ceil() as usize
    }

    /// Bound on the nodes of the lattice that are evaluated.
    pub fn max_nodes(self) -> usize {
        ((MAX_EXCESS * self.counts().nodes * self.extent()).ceil() as usize).max(LEAST_NODES)
    }

    /// The price of the mesh: expected flops, and the bytes of the largest one that is made. `flops` are
    /// those of one evaluation of the field.
    pub fn price(self, flops: f64) -> Price {
        let (counts, extent) = (self.counts(), self.extent());
        let (rounds, gradients) = match self.quality {
            Quality::Regular if self.dimension == 3 => {
                (ROUNDS_OF_REGULAR, SMOOTHINGS * counts.regular_vertices)
            }
            Quality::Raw | Quality::Regular => (ROUNDS, counts.raw_vertices),
        };
        let values = counts.nodes + rounds * counts.raw_vertices;
        let bytes_per_node = BYTES_PER_NODE + BYTES_PER_VERTEX * counts.raw_vertices / counts.nodes;
        Price {
            n_bytes: (self.max_nodes() as f64 * bytes_per_node) as usize,
            flops: extent * ((values + gradients) * flops + counts.raw_vertices * FLOPS_PER_VERTEX),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_of_nothing_costs_more_than_any_machine_has() {
        let size = MeshSize { n_points: 100, dimension: 3, step: 1e-200, quality: Quality::Raw };
        assert_eq!(size.price(1.0).n_bytes, usize::MAX);
        assert_eq!(size.n_vertices(), usize::MAX);
    }

    #[test]
    fn half_the_step_costs_four_times_as_much_in_space_and_twice_in_the_plane() {
        for (dimension, factor) in [(2, 2.0), (3, 4.0)] {
            let of = |step: f64| {
                let size = MeshSize { n_points: 1000, dimension, step, quality: Quality::Regular };
                size.price(1e4).flops
            };
            assert!((of(0.5) / of(1.0) - factor).abs() < 1e-12);
        }
    }
}
