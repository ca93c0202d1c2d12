//! Triangles with the triangles around each vertex.

use rayon::prelude::*;
use smallvec::SmallVec;

use crate::machine::vector::{dot, norm};
use crate::mesh::Mesh;
use crate::mesh::places::{cross, sub};

/// Triangles at a vertex.
pub type Star = SmallVec<[u32; 8]>;

/// A triangle that was removed.
const REMOVED: [u32; 3] = [u32::MAX; 3];

/// Triangles of a surface in space, which can be changed one by one.
pub struct Triangulation {
    pub positions: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
    /// Triangles at each vertex. A vertex without triangles was removed.
    pub stars: Vec<Star>,
    /// Vertices on the boundary stay where they are.
    pub is_fixed: Vec<bool>,
}

impl Triangulation {
    pub fn of(mesh: &Mesh) -> Self {
        let positions = mesh.vertices.chunks_exact(3).map(|x| [x[0], x[1], x[2]]).collect();
        let triangles: Vec<[u32; 3]> = mesh.cells.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        let mut stars = vec![Star::new(); mesh.n_vertices()];
        for (at, triangle) in triangles.iter().enumerate() {
            triangle.iter().for_each(|&vertex| stars[vertex as usize].push(at as u32));
        }
        let mut found = Self { positions, triangles, stars, is_fixed: vec![false; mesh.n_vertices()] };
        found.is_fixed = (0..mesh.n_vertices() as u32).map(|vertex| found.is_on_boundary(vertex)).collect();
        found
    }

    pub fn position(&self, vertex: u32) -> &[f64; 3] {
        &self.positions[vertex as usize]
    }

    pub fn star(&self, vertex: u32) -> &Star {
        &self.stars[vertex as usize]
    }

    /// The vertices that share a triangle with a vertex, sorted.
    pub fn neighbours(&self, vertex: u32) -> SmallVec<[u32; 16]> {
        let of_star = self.star(vertex).iter().flat_map(|&at| self.triangles[at as usize]);
        let mut found: SmallVec<[u32; 16]> = of_star.filter(|&other| other != vertex).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    fn is_on_boundary(&self, vertex: u32) -> bool {
        self.neighbours(vertex).len() != self.star(vertex).len()
    }

    /// Twice the area vector of a triangle with its vertices at given places.
    pub fn area_vector(places: [&[f64; 3]; 3]) -> [f64; 3] {
        let [a, b, c] = places;
        cross(sub(b, a), sub(c, a))
    }

    pub fn normal_of(&self, triangle: [u32; 3]) -> [f64; 3] {
        Self::area_vector(triangle.map(|vertex| self.position(vertex)))
    }

    /// The triangles at both ends of an edge.
    pub fn beside(&self, a: u32, b: u32) -> SmallVec<[u32; 2]> {
        self.star(a).iter().copied().filter(|&at| self.triangles[at as usize].contains(&b)).collect()
    }

    /// The edges by their ends, each once, in the order of its first end.
    pub fn edges(&self) -> Vec<[u32; 2]> {
        let n = self.stars.len() as u32;
        let of_vertex = |a: u32| self.neighbours(a).into_iter().filter(move |&b| b > a).map(move |b| [a, b]);
        (0..n).into_par_iter().flat_map_iter(of_vertex).collect()
    }

    pub fn squared_length(&self, a: u32, b: u32) -> f64 {
        let edge = sub(self.position(a), self.position(b));
        dot(&edge, &edge)
    }

    pub fn remove(&mut self, at: u32) {
        for vertex in std::mem::replace(&mut self.triangles[at as usize], REMOVED) {
            self.stars[vertex as usize].retain(|other| *other != at);
        }
    }

    /// Cosine of the angle at `apex` in the triangle with `a` and `b`, and its sine.
    pub fn angle(&self, apex: u32, a: u32, b: u32) -> [f64; 2] {
        let [u, v] = [a, b].map(|end| sub(self.position(end), self.position(apex)));
        let (along, across) = (dot(&u, &v), norm(&cross(u, v)));
        let length = (along * along + across * across).sqrt();
        if length > 0.0 { [along / length, across / length] } else { [1.0, 0.0] }
    }

    /// The mesh of what is left, vertices in their order.
    pub fn into_mesh(self) -> Mesh {
        let mut place = vec![u32::MAX; self.positions.len()];
        let mut vertices = Vec::new();
        for (vertex, _) in self.stars.iter().enumerate().filter(|(_, star)| !star.is_empty()) {
            place[vertex] = (vertices.len() / 3) as u32;
            vertices.extend(self.positions[vertex]);
        }
        let left = self.triangles.iter().filter(|triangle| **triangle != REMOVED);
        let cells = left.flat_map(|triangle| triangle.map(|vertex| place[vertex as usize])).collect();
        Mesh { dimension: 3, vertices, cells }
    }
}
