//! Price of a mesh, from the points and the step alone.

use super::Quality;
use crate::machine::price::Price;
use crate::sums::price::pair_flops;

/// Area of a surface over n h₄²: 1 for a lattice of points, 1.5 for random ones. For d = 2, length over n h₄.
const AREA_PER_POINT: f64 = 1.2;

/// Counts for a surface of one step to the power d − 1, measured on tori and circles.
struct Counts {
    nodes: f64,
    raw_vertices: f64,
    regular_vertices: f64,
}

const PLANE: Counts = Counts { nodes: 4.5, raw_vertices: 2.7, regular_vertices: 2.7 };
const SPACE: Counts = Counts { nodes: 5.3, raw_vertices: 6.5, regular_vertices: 1.3 };

/// Evaluations of f for a vertex: rounds of root finding.
const ROUNDS: f64 = 6.0;

/// Evaluations of gradients for a vertex of a regular mesh: smoothing and the last steps.
const SMOOTHINGS: f64 = 9.0;

/// Bytes for a raw vertex with its two triangles, edges and stars, and for a node with its cells.
const BYTES_PER_VERTEX: f64 = 320.0;
const BYTES_PER_NODE: f64 = 80.0;

/// Nodes over the expected ones up to which a surface is followed.
const MAX_EXCESS: f64 = 8.0;

/// Flops of a raw vertex beside its evaluations: cells, cuts, and making the triangles regular.
const FLOPS_PER_VERTEX: f64 = 2e4;

/// Flops of one evaluation of a function with n centres.
pub fn dense_evaluation(n_points: usize, dimension: usize) -> f64 {
    n_points as f64 * pair_flops(dimension, 0)
}

/// Flops of one evaluation of the field of local regressions.
pub const LOCAL_EVALUATION: f64 = 2e4;

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

    /// Size of the surface in steps to the power d − 1.
    fn extent(self) -> f64 {
        AREA_PER_POINT * self.n_points as f64 / self.step.powi(self.dimension as i32 - 1)
    }

    /// Expected number of vertices.
    pub fn n_vertices(self) -> usize {
        let counts = self.counts();
        let each = if self.quality == Quality::Raw { counts.raw_vertices } else { counts.regular_vertices };
        (each * self.extent()).ceil() as usize
    }

    /// Most nodes of the lattice that may be evaluated.
    pub fn max_nodes(self) -> usize {
        (MAX_EXCESS * self.counts().nodes * self.extent()).max(1e5) as usize
    }

    /// The price of the mesh. `flops` are those of one evaluation of the field.
    pub fn price(self, flops: f64) -> Price {
        let (counts, extent) = (self.counts(), self.extent());
        let evaluations = counts.nodes + ROUNDS * counts.raw_vertices;
        let gradients = match self.quality {
            Quality::Raw => counts.raw_vertices,
            Quality::Regular => SMOOTHINGS * counts.regular_vertices,
        };
        let n_bytes = extent * (BYTES_PER_VERTEX * counts.raw_vertices + BYTES_PER_NODE * counts.nodes);
        Price {
            n_bytes: n_bytes.min(usize::MAX as f64 / 2.0) as usize,
            flops: extent * ((evaluations + gradients) * flops + counts.raw_vertices * FLOPS_PER_VERTEX),
        }
    }
}
