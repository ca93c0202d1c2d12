//! Answers as files of other programs: points or a mesh in space, with quantities at each vertex.

mod gltf;
mod obj;
mod ply;

use std::sync::Arc;

use super::array::Array;
use crate::wire::negotiation::Format;

/// Positions in space, one after the other.
pub trait Positions: Send + Sync {
    /// Coordinates of all positions, `[n, d]`.
    fn coordinates(&self) -> &[f64];

    /// Coordinates of a position, at least 1.
    fn dimension(&self) -> usize;
}

impl dyn Positions {
    fn n_points(&self) -> usize {
        self.coordinates().len() / self.dimension()
    }

    fn points(&self) -> impl ExactSizeIterator<Item = &[f64]> + Clone {
        self.coordinates().chunks_exact(self.dimension())
    }
}

/// The place of an answer in space. It is written in the formats of models alone.
pub struct Shape {
    /// Positions of the vertices, d = 2 or 3.
    pub positions: Arc<dyn Positions>,
    /// Vertices of each segment or triangle, `[l, d]`. Empty for points.
    pub cells: Vec<u32>,
    /// Small numbers at the vertices, with the names of their properties.
    pub labels: Vec<(&'static str, Vec<u8>)>,
}

impl Shape {
    /// Points without cells.
    pub fn of_points(positions: Arc<dyn Positions>) -> Self {
        Self { positions, cells: Vec::new(), labels: Vec::new() }
    }
}

/// Quantities that programs colour by when they know no names, the preferred one first.
const QUALITIES: [&str; 5] = ["mean_curvature", "position_std", "normal_std", "residual", "level"];

/// A number at each vertex.
pub struct Property<'a> {
    /// The name in files: singular, with an index for each component.
    pub name: String,
    array: &'a Array,
    component: usize,
}

impl Property<'_> {
    /// The number at a vertex, NaN where there is none.
    pub fn number(&self, vertex: usize) -> f64 {
        self.array.row_entry(vertex, self.component)
    }

    fn at(&self, vertex: usize) -> f32 {
        self.number(vertex) as f32
    }
}

/// A shape with what the answer says at its vertices.
pub struct Model<'a> {
    shape: &'a Shape,
    /// Unit normals, `[k, d]`.
    normals: Option<&'a Array>,
    properties: Vec<Property<'a>>,
}

impl<'a> Model<'a> {
    /// Takes the arrays with a row for each vertex.
    pub fn of(shape: &'a Shape, arrays: impl Iterator<Item = (&'a str, &'a Array)>) -> Self {
        let n = shape.positions.n_points();
        let mut model = Self { shape, normals: None, properties: Vec::new() };
        for (name, array) in arrays.filter(|(name, array)| array.shape()[0] == n && *name != "vertices") {
            if name == "normals" {
                model.normals = Some(array);
                continue;
            }
            let singular = name.strip_suffix('s').unwrap_or(name);
            let n_components = array.shape()[1..].iter().product();
            for component in 0..n_components {
                let name = if array.shape().len() == 1 {
                    singular.to_owned()
                } else {
                    format!("{singular}_{component}")
                };
                model.properties.push(Property { name, array, component });
            }
        }
        model
    }

    /// The bytes of a file. `None` for other formats than those of models.
    pub fn write(&self, format: Format) -> Option<Vec<u8>> {
        match format {
            Format::Ply => Some(ply::write(self)),
            Format::Gltf => gltf::write(self),
            Format::Obj => Some(obj::write(self)),
            Format::Json | Format::Safetensors | Format::Npy => None,
        }
    }

    pub fn n_vertices(&self) -> usize {
        self.shape.positions.n_points()
    }

    /// A position or normal in space. The third coordinate of the plane is 0.
    fn in_space(row: &[f64]) -> [f64; 3] {
        [row[0], row[1], row.get(2).copied().unwrap_or(0.0)]
    }

    /// The unit normal at a vertex, in space.
    pub fn normal(&self, vertex: usize) -> Option<[f64; 3]> {
        let (normals, d) = (self.normals?, self.shape.positions.dimension());
        let row: Vec<f64> = (0..d).map(|axis| normals.row_entry(vertex, axis)).collect();
        Some(Self::in_space(&row))
    }

    /// Numbers at the vertices beside positions and normals.
    pub fn properties(&self) -> &[Property<'a>] {
        &self.properties
    }

    fn cells(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        self.shape.cells.chunks_exact(self.shape.positions.dimension())
    }

    /// The property that programs colour by.
    pub fn quality(&self) -> Option<&Property<'a>> {
        QUALITIES.iter().find_map(|name| self.properties.iter().find(|property| property.name == *name))
    }
}
