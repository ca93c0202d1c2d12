//! Price of a mesh, from the number of points, the step and the box that it is cut off by.

use super::level_set::SEEDING_POINTS;
use super::surface::seed_bytes;
use super::{Bounds, Quality};
use crate::machine::price::Price;
use crate::points::cloud::Cloud;
use crate::points::sampling::sampling_price;

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

/// Evaluations of f for a point: its value, and its foot, which takes the gradient as well.
const EVALUATIONS_PER_POINT: f64 = 3.0;

/// Bytes for a raw vertex with its two triangles, edges and stars, and for a node with its cell.
const BYTES_PER_VERTEX: f64 = 320.0;
const BYTES_PER_NODE: f64 = 80.0;

/// Flops of a raw vertex beside its evaluations: cells, cuts, its nearest point, and regular triangles.
const FLOPS_PER_VERTEX: f64 = 2e4;

/// Flops of one evaluation of the field of local regressions: its nearest points, their quadrics, and where
/// these do not agree, a winding number.
pub(crate) const LOCAL_EVALUATION: f64 = 2e4;

/// Bytes and flops of a point before anything is followed: areas, dipoles, winding numbers and quadrics.
/// Both are estimates.
const BYTES_PER_POINT: usize = 700;
const FLOPS_PER_POINT: f64 = 1e5;

/// Extent of a mesh that is to be made.
#[derive(Debug, Clone, Copy)]
pub struct MeshSize {
    pub n_points: usize,
    pub dimension: usize,
    /// Step in median spacings of the points.
    pub step: f64,
    pub quality: Quality,
    /// Box that the surface is followed in, if it is not where the cloud is.
    pub within: Option<Within>,
}

/// A box that a mesh is cut off by.
#[derive(Debug, Clone, Copy)]
pub struct Within {
    /// Points of the cloud in the box.
    n_points: usize,
    /// Sides of the box in steps. In the plane, the third one is 0.
    sides: [f64; 3],
    /// True if the surface may go on where there are no points: a level of values.
    goes_on: bool,
}

impl Within {
    /// Looks at a box around a cloud, d = 2 or 3. `step` is the longest edge of the lattice, L.
    pub fn of(bounds: &Bounds, cloud: &Cloud, step: f64, goes_on: bool) -> Self {
        let mut sides = [0.0; 3];
        let lengths = bounds.min.iter().zip(&bounds.max).map(|(min, max)| (max - min) / step);
        sides.iter_mut().zip(lengths).for_each(|(side, length)| *side = length);
        Self { n_points: cloud.points().filter(|x| bounds.contains(x)).count(), sides, goes_on }
    }

    /// Size of a flat surface through the box, at most, in steps to the power d − 1: half of the boundary of
    /// the box. A plane cuts the boundary in two parts, and each is larger than the cut.
    fn section(&self, dimension: usize) -> f64 {
        let [a, b, c] = self.sides;
        if dimension == 2 { a + b } else { a * b + b * c + c * a }
    }

    /// Most nodes of the lattice at the corners of cells that begin in the box. Cells are less than two steps
    /// long, and a node has `√¾` or ½ of the volume of a cube of a step.
    fn most_nodes(&self, dimension: usize) -> f64 {
        let volume: f64 = self.sides[..dimension].iter().map(|side| side + 4.0).product();
        volume / if dimension == 2 { 0.75_f64.sqrt() } else { 0.5 }
    }
}

impl MeshSize {
    fn counts(self) -> Counts {
        if self.dimension == 2 { PLANE } else { SPACE }
    }

    /// Size of a surface through so many points, in steps to the power d − 1.
    fn through(self, n_points: usize) -> f64 {
        AREA_PER_POINT * n_points as f64 / self.step.powi(self.dimension as i32 - 1)
    }

    /// Expected size of the surface in steps to the power d − 1.
    ///
    /// In a box, it is that through the points of the box, and no less than a flat surface has.
    fn extent(self) -> f64 {
        let whole = self.through(self.n_points);
        let Some(within) = self.within else { return whole };
        let most = if within.goes_on { MAX_EXCESS * whole } else { whole };
        self.through(within.n_points).max(within.section(self.dimension)).min(most)
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

    /// Bound on the nodes of the lattice that are evaluated: for a surface through all points, and for all
    /// of the box.
    pub fn max_nodes(self) -> usize {
        let expected = MAX_EXCESS * self.counts().nodes * self.through(self.n_points);
        let most = (expected.ceil() as usize).max(LEAST_NODES);
        self.within.map_or(most, |within| most.min(within.most_nodes(self.dimension).ceil() as usize))
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
        let followed = Price {
            n_bytes: (self.max_nodes() as f64 * bytes_per_node) as usize,
            flops: extent * ((values + gradients) * flops + counts.raw_vertices * FLOPS_PER_VERTEX),
        };
        followed.and(self.preparing(flops))
    }

    /// The price of what is known of each point before the surface is followed from its foot: `flops` are
    /// those of one evaluation of the field.
    fn preparing(self, flops: f64) -> Price {
        let Self { n_points, dimension, .. } = self;
        let seeds = n_points.min(SEEDING_POINTS).saturating_mul(seed_bytes(dimension));
        let each = Price {
            n_bytes: n_points.saturating_mul(BYTES_PER_POINT).saturating_add(seeds),
            flops: n_points as f64 * (FLOPS_PER_POINT + EVALUATIONS_PER_POINT * flops),
        };
        each.and(sampling_price(n_points, dimension))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::fibonacci_sphere;

    fn whole(n_points: usize, dimension: usize, step: f64) -> MeshSize {
        MeshSize { n_points, dimension, step, quality: Quality::Raw, within: None }
    }

    /// A mesh over a sphere of 1,000 points with a step of its spacing, in a cube of these corners.
    fn in_cube(min: f64, max: f64, goes_on: bool) -> MeshSize {
        let (cloud, step) = (fibonacci_sphere(1000), 0.1);
        let bounds = Bounds { min: vec![min; 3], max: vec![max; 3] };
        let within = Some(Within::of(&bounds, &cloud, step, goes_on));
        MeshSize { within, ..whole(1000, 3, 1.0) }
    }

    #[test]
    fn small_boxes_cost_what_is_in_them_and_large_ones_what_may_be() {
        let (all, flops) = (whole(1000, 3, 1.0), |size: MeshSize| size.extent());
        // An eighth of the sphere, whose points and sections are about as large.
        assert!((0.1..0.35).contains(&(flops(in_cube(0.0, 1.0, false)) / flops(all))));
        assert!(flops(in_cube(0.5, 0.6, false)) < 0.01 * flops(all));
        // The surface of a cloud ends with it, and a level of values does not.
        assert_eq!(flops(in_cube(-100.0, 100.0, false)), flops(all));
        assert_eq!(flops(in_cube(-100.0, 100.0, true)), MAX_EXCESS * flops(all));
        assert_eq!(in_cube(-100.0, 100.0, true).max_nodes(), all.max_nodes());
        assert!(in_cube(0.5, 0.6, true).max_nodes() < all.max_nodes() / 40);
        let followed = |size: MeshSize| size.price(1.0).n_bytes - size.preparing(1.0).n_bytes;
        assert!(followed(in_cube(0.5, 0.6, true)) < followed(all) / 40);
    }

    #[test]
    fn a_step_longer_than_the_cloud_costs_what_its_points_do() {
        let n = 10_000;
        let evaluation = 1e5;
        let price = whole(n, 3, 1e6).price(evaluation);
        assert!(price.flops > 2.0 * n as f64 * evaluation && price.n_bytes > 100 * n);
    }

    #[test]
    fn a_step_of_nothing_costs_more_than_any_machine_has() {
        let size = whole(100, 3, 1e-200);
        assert_eq!(size.price(1.0).n_bytes, usize::MAX);
        assert_eq!(size.n_vertices(), usize::MAX);
    }

    #[test]
    fn half_the_step_costs_four_times_as_much_in_space_and_twice_in_the_plane() {
        for (dimension, factor) in [(2, 2.0), (3, 4.0)] {
            let of = |step: f64| {
                let size = whole(1000, dimension, step);
                size.price(1e4).flops - size.preparing(1e4).flops
            };
            assert!((of(0.5) / of(1.0) - factor).abs() < 1e-12);
        }
    }
}
