//! The body-centred lattice and its Freudenthal triangulation, whose simplices are cut by a level set.
//!
//! A node has integer coordinates `u`, and stands at `origin + step·B u`. The columns of B span the
//! triangular lattice for d = 2 and the body-centred cubic lattice for d = 3, so the simplices are nearly
//! regular: all angles of the triangles are 60°, and tetrahedra have faces with sides 1, √3/2 and √3/2. A
//! cell is the parallelepiped of the 2ᵈ nodes `u + {0, 1}ᵈ`. Freudenthal's triangulation cuts it into d!
//! simplices, one for each order of the axes (Freudenthal, "Simplizialzerlegungen von beschränkter
//! Flachheit", 1942). Neighbouring cells agree on their common faces. So the level of a function that is
//! linear on every simplex is a manifold.

use std::hash::Hasher;

use smallvec::SmallVec;

use crate::machine::random::mixed;
use crate::machine::small::Small;

/// Bits of a coordinate of a node.
const BITS: u32 = 20;

/// Coordinate of the node at the origin, in the middle of what the bits hold.
const MIDDLE: i64 = 1 << (BITS - 1);

/// Greatest magnitude of a coordinate. The margin keeps sums with the nodes of a cell inside their bits.
pub const MAX_COORDINATE: i64 = MIDDLE - 4;

/// A node of the lattice: its integer coordinates, packed. Corners are found without unpacking.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Node(u64);

/// A corner of a cell: the set of axes along which it is one step away from the first corner, as bits.
pub type Corner = usize;

impl Node {
    fn of(coordinates: &[i64]) -> Self {
        let pack = |packed: u64, &u: &i64| (packed << BITS) | (u + MIDDLE) as u64;
        Self(coordinates.iter().rev().fold(0, pack))
    }

    fn coordinate(self, axis: usize) -> i64 {
        ((self.0 >> (BITS * axis as u32)) & ((1 << BITS) - 1)) as i64 - MIDDLE
    }

    /// The corner of the cell whose first corner this node is.
    pub fn corner(self, corner: Corner) -> Self {
        Self(self.0 + offset(corner))
    }

    /// The node whose corner this node is.
    pub fn before(self, corner: Corner) -> Self {
        Self(self.0 - offset(corner))
    }
}

/// A hash of nodes, the same in every process. It mixes all bits, so no lattice fills one place of a table.
#[derive(Debug, Clone, Copy, Default)]
pub struct NodeHasher(u64);

impl Hasher for NodeHasher {
    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.write_u64(byte.into()));
    }

    fn write_u64(&mut self, x: u64) {
        self.0 = mixed(self.0 ^ x);
    }

    fn finish(&self) -> u64 {
        self.0
    }
}

const fn offset(corner: Corner) -> u64 {
    let mut sum = 0;
    let mut axis = 0;
    while axis < 3 {
        if corner >> axis & 1 == 1 {
            sum += 1 << (BITS * axis);
        }
        axis += 1;
    }
    sum
}

/// An edge of a simplex: from a node to its corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Edge(u64);

impl Edge {
    /// The edge between two corners of a cell, one of which contains the other.
    pub fn of(cell: Node, from: Corner, to: Corner) -> Self {
        Self(cell.corner(from & to).0 << 3 | (from ^ to) as u64)
    }

    pub fn ends(self) -> [Node; 2] {
        let first = Node(self.0 >> 3);
        [first, first.corner((self.0 & 7) as usize)]
    }
}

/// Placement of the lattice in space, d = 2 or 3.
#[derive(Debug, Clone)]
pub struct Lattice {
    origin: Small,
    step: f64,
}

/// Position of the origin within a cell, in steps. Symmetric surfaces about the middle of a cloud do not pass
/// through whole planes of nodes.
const SHIFT: [f64; 3] = [0.137, 0.291, 0.413];

impl Lattice {
    /// Places a node near `centre`. `step` is the longest edge of the simplices.
    pub fn new(centre: &[f64], step: f64) -> Self {
        Self { origin: centre.iter().zip(SHIFT).map(|(x, shift)| x + shift * step).collect(), step }
    }

    pub fn dimension(&self) -> usize {
        self.origin.len()
    }

    /// Position of a node, `[d]`.
    pub fn position(&self, node: Node) -> Small {
        let u = |axis| node.coordinate(axis) as f64;
        let rows: Small = match self.dimension() {
            2 => Small::from_slice(&[u(0) - 0.5 * u(1), 0.75_f64.sqrt() * u(1)]),
            _ => {
                let half = 0.5 * (u(0) + u(1) + u(2));
                Small::from_slice(&[half - u(0), half - u(1), half - u(2)])
            }
        };
        rows.iter().zip(&self.origin).map(|(row, origin)| origin + self.step * row).collect()
    }

    /// The cell that contains a position, or `None` if it is too far from the origin for the bits.
    pub fn cell(&self, x: &[f64]) -> Option<Node> {
        let row = |axis: usize| (x[axis] - self.origin[axis]) / self.step;
        let u: Small = match self.dimension() {
            2 => {
                let second = row(1) / 0.75_f64.sqrt();
                Small::from_slice(&[row(0) + 0.5 * second, second])
            }
            _ => Small::from_slice(&[row(1) + row(2), row(0) + row(2), row(0) + row(1)]),
        };
        // Compared as floats: a short step takes them beyond i64. NaN is not in the range either.
        let is_held = |u: &f64| u.floor().abs() <= MAX_COORDINATE as f64;
        let floors: SmallVec<[i64; 4]> = u.iter().map(|u| u.floor() as i64).collect();
        u.iter().all(is_held).then(|| Node::of(&floors))
    }

    /// Whether the coordinates of a cell leave room for its neighbours.
    pub fn holds(&self, cell: Node) -> bool {
        (0..self.dimension()).all(|axis| cell.coordinate(axis).abs() <= MAX_COORDINATE)
    }

    /// The simplices of a cell by their corners, `[d!][d + 1]`, all of positive orientation.
    pub fn simplices(&self) -> &'static [&'static [Corner]] {
        match self.dimension() {
            2 => &[&[0, 1, 3], &[0, 3, 2]],
            // Orders of the axes; odd ones have their last two corners exchanged. det B > 0.
            _ => &[&[0, 1, 3, 7], &[0, 2, 6, 7], &[0, 4, 5, 7], &[0, 1, 7, 5], &[0, 2, 7, 3], &[0, 4, 7, 6]],
        }
    }
}
