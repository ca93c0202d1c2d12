//! Connected parts of a mesh, and what their topology and size are.

use smallvec::SmallVec;

use super::Mesh;
use super::places::size;

/// One connected part of a mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Part {
    pub n_vertices: usize,
    pub n_cells: usize,
    /// Vertices − segments (d = 2), or vertices − edges + triangles (d = 3): 0 for a closed curve, 2 for a
    /// sphere, 0 for a torus.
    pub euler_characteristic: i64,
    /// Edges of one triangle (d = 3), or vertices of one segment (d = 2). 0 if the part is closed.
    pub n_boundary_edges: usize,
    /// Length (d = 2, unit L) or area (d = 3, unit L²).
    pub area: f64,
    /// Vertices that are farther than three spacings from all points. 0 until they are counted.
    pub n_far: usize,
}

/// The parts of a mesh, largest first, and the part of each vertex, `[k]`.
pub struct Parts {
    pub parts: Vec<Part>,
    pub of_vertex: Vec<u32>,
}

impl Parts {
    pub fn of(mesh: &Mesh) -> Self {
        let labels = mesh.labels(|_, _| true);
        let n_parts = labels.iter().map(|&label| label as usize + 1).max().unwrap_or(0);
        let mut parts = vec![Part::default(); n_parts];
        for &label in &labels {
            parts[label as usize].n_vertices += 1;
            parts[label as usize].euler_characteristic += 1;
        }
        let d = mesh.dimension;
        for cell in mesh.cells() {
            let part = &mut parts[labels[cell[0] as usize] as usize];
            part.n_cells += 1;
            part.euler_characteristic += if d == 3 { 1 } else { -1 };
            let vertices: SmallVec<[&[f64]; 3]> = cell.iter().map(|&vertex| mesh.vertex(vertex)).collect();
            part.area += size(&vertices);
        }
        for same in mesh.facets().chunk_by(|a, b| a == b) {
            let part = &mut parts[labels[same[0][0] as usize] as usize];
            part.n_boundary_edges += usize::from(same.len() == 1);
            part.euler_characteristic -= i64::from(d == 3);
        }
        largest_first(parts, labels)
    }
}

impl Parts {
    /// The parts with the vertices that are far from all points, `[k]`, counted.
    pub fn with_far(mut self, is_far: &[bool]) -> Vec<Part> {
        for (&part, &is_far) in self.of_vertex.iter().zip(is_far) {
            self.parts[part as usize].n_far += usize::from(is_far);
        }
        self.parts
    }
}

fn largest_first(parts: Vec<Part>, labels: Vec<u32>) -> Parts {
    let mut order: Vec<usize> = (0..parts.len()).collect();
    order.sort_by_key(|&part| std::cmp::Reverse(parts[part].n_cells));
    let mut place = vec![0; parts.len()];
    order.iter().enumerate().for_each(|(at, &part)| place[part] = at as u32);
    Parts {
        parts: order.iter().map(|&part| parts[part]).collect(),
        of_vertex: labels.iter().map(|&label| place[label as usize]).collect(),
    }
}
