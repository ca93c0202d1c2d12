//! PLY 1.0, binary little-endian (Turk 1994), for `CloudCompare`, `MeshLab` and Blender.

use super::Model;

/// Writes positions as double, since clouds may lie far from the origin, and quantities as float.
/// `quality` is the one that `MeshLab` colours by. Nulls are NaN.
pub(super) fn write(model: &Model<'_>) -> Vec<u8> {
    let mut out = header(model).into_bytes();
    for (vertex, position) in model.shape.positions.points().enumerate() {
        Model::in_space(position).iter().for_each(|x| out.extend(x.to_le_bytes()));
        let mut float = |x: f32| out.extend(x.to_le_bytes());
        model.normal(vertex).iter().flatten().for_each(|x| float(*x as f32));
        model.properties.iter().chain(model.quality()).for_each(|property| float(property.at(vertex)));
        model.shape.labels.iter().for_each(|(_, labels)| out.push(labels[vertex]));
    }
    for cell in model.cells() {
        if cell.len() == 3 {
            out.push(3);
        }
        cell.iter().for_each(|vertex| out.extend((*vertex as i32).to_le_bytes()));
    }
    out
}

fn header(model: &Model<'_>) -> String {
    let mut lines = vec!["ply".to_owned(), "format binary_little_endian 1.0".to_owned()];
    lines.push("comment gramian: unit of lengths is that of the points".to_owned());
    lines.push(format!("element vertex {}", model.n_vertices()));
    lines.extend(["x", "y", "z"].map(|axis| format!("property double {axis}")));
    if model.normals.is_some() {
        lines.extend(["nx", "ny", "nz"].map(|axis| format!("property float {axis}")));
    }
    lines.extend(model.properties.iter().map(|property| format!("property float {}", property.name)));
    lines.extend(model.quality().map(|_| "property float quality".to_owned()));
    lines.extend(model.shape.labels.iter().map(|(name, _)| format!("property uchar {name}")));
    let n_cells = model.cells().len();
    match model.shape.positions.dimension() {
        _ if n_cells == 0 => {}
        2 => {
            lines.push(format!("element edge {n_cells}"));
            lines.extend(["property int vertex1".to_owned(), "property int vertex2".to_owned()]);
        }
        _ => {
            lines.push(format!("element face {n_cells}"));
            lines.push("property list uchar int vertex_indices".to_owned());
        }
    }
    lines.push("end_header\n".to_owned());
    lines.join("\n")
}
