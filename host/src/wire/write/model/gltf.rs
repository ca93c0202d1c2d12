//! glTF 2.0 as a single binary file (GLB), with quantities as attributes of their own (`_MEAN_CURVATURE`).

use serde_json::{Value, json};

use super::Model;

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const POINTS: u32 = 0;
const LINES: u32 = 1;
const TRIANGLES: u32 = 4;

/// Data of the file, with the views and accessors that describe it.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Adds numbers of four bytes each. Returns the index of the accessor.
    fn add(&mut self, numbers: impl Iterator<Item = [u8; 4]>, mut accessor: Value) -> usize {
        let start = self.bytes.len();
        numbers.for_each(|number| self.bytes.extend(number));
        self.views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": self.bytes.len() - start}));
        accessor["bufferView"] = json!(self.views.len() - 1);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }
}

/// Writes the file. `None` if it would exceed the 4 GiB that its header can say.
///
/// Positions are float32, so they are relative to the middle of the box, which is the translation of the
/// node.
pub(super) fn write(model: &Model<'_>) -> Option<Vec<u8>> {
    let cloud = &model.shape.positions;
    let n = model.n_vertices();
    let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for position in cloud.points().map(Model::in_space) {
        for (axis, x) in position.into_iter().enumerate() {
            min[axis] = min[axis].min(x);
            max[axis] = max[axis].max(x);
        }
    }
    let middle = [0, 1, 2].map(|axis| 0.5 * (min[axis] + max[axis]));
    let relative = |x: [f64; 3]| [0, 1, 2].map(|axis| (x[axis] - middle[axis]) as f32);
    let mut buffer = Buffer::default();
    let positions = cloud.points().flat_map(|x| relative(Model::in_space(x)));
    let bounds = json!({"componentType": FLOAT, "type": "VEC3", "count": n, "min": relative(min), "max": relative(max)});
    let mut attributes = json!({"POSITION": buffer.add(positions.map(f32::to_le_bytes), bounds)});
    if model.normals.is_some() {
        let normals = (0..n).flat_map(|vertex| unit(model.normal(vertex)));
        let accessor = json!({"componentType": FLOAT, "type": "VEC3", "count": n});
        attributes["NORMAL"] = json!(buffer.add(normals.map(f32::to_le_bytes), accessor));
    }
    for property in &model.properties {
        // glTF knows no NaN.
        let finite = |x: f32| if x.is_finite() { x } else { 0.0 };
        let numbers = (0..n).map(|vertex| finite(property.at(vertex)).to_le_bytes());
        let accessor = json!({"componentType": FLOAT, "type": "SCALAR", "count": n});
        attributes[format!("_{}", property.name.to_uppercase())] = json!(buffer.add(numbers, accessor));
    }
    for (name, labels) in &model.shape.labels {
        let numbers = labels.iter().map(|label| f32::from(*label).to_le_bytes());
        let accessor = json!({"componentType": FLOAT, "type": "SCALAR", "count": n});
        attributes[format!("_{}", name.to_uppercase())] = json!(buffer.add(numbers, accessor));
    }
    let mode = match (model.shape.cells.is_empty(), cloud.dimension()) {
        (true, _) => POINTS,
        (false, 2) => LINES,
        (false, _) => TRIANGLES,
    };
    let mut primitive = json!({"attributes": attributes, "mode": mode});
    if mode != POINTS {
        let indices = model.shape.cells.iter().map(|vertex| vertex.to_le_bytes());
        let accessor =
            json!({"componentType": UNSIGNED_INT, "type": "SCALAR", "count": model.shape.cells.len()});
        primitive["indices"] = json!(buffer.add(indices, accessor));
    }
    let document = json!({
        "asset": {"version": "2.0", "generator": "gramian"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": middle}],
        "meshes": [{"primitives": [primitive]}],
        "buffers": [{"byteLength": buffer.bytes.len()}],
        "bufferViews": buffer.views,
        "accessors": buffer.accessors,
    });
    container(&document, &buffer.bytes)
}

/// A unit normal in float32. Vertices without one get the third axis, since glTF has no null.
fn unit(normal: Option<[f64; 3]>) -> [f32; 3] {
    let known = normal.filter(|normal| normal.iter().map(|c| c * c).sum::<f64>() > 0.5);
    known.unwrap_or([0.0, 0.0, 1.0]).map(|c| c as f32)
}

/// The GLB container: header, JSON chunk padded by spaces, binary chunk. The data is whole words.
fn container(document: &Value, data: &[u8]) -> Option<Vec<u8>> {
    let mut text = serde_json::to_vec(document).ok()?;
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = u32::try_from(12 + 8 + text.len() + 8 + data.len()).ok()?;
    let mut out = Vec::with_capacity(total as usize);
    out.extend(b"glTF");
    [2, total, text.len() as u32].iter().for_each(|word: &u32| out.extend(word.to_le_bytes()));
    out.extend(b"JSON");
    out.append(&mut text);
    out.extend((data.len() as u32).to_le_bytes());
    out.extend(b"BIN\0");
    out.extend(data);
    Some(out)
}
