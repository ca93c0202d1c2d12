//! Wavefront OBJ: positions, normals and cells as text. It has no place for quantities.

use std::fmt::Write;

use super::Model;

pub(super) fn write(model: &Model<'_>) -> Vec<u8> {
    let mut out = String::new();
    // Writing to a string never fails.
    let mut line = |arguments: std::fmt::Arguments<'_>| _ = out.write_fmt(arguments);
    for position in model.shape.positions.points() {
        let [x, y, z] = Model::in_space(position);
        line(format_args!("v {x} {y} {z}\n"));
    }
    for [x, y, z] in (0..model.n_vertices()).filter_map(|vertex| model.normal(vertex)) {
        line(format_args!("vn {x:.7} {y:.7} {z:.7}\n"));
    }
    let has_normals = model.normals.is_some();
    for cell in model.cells() {
        match *cell {
            [a, b, c] if has_normals => {
                let [a, b, c] = [a, b, c].map(|vertex| vertex + 1);
                line(format_args!("f {a}//{a} {b}//{b} {c}//{c}\n"));
            }
            [a, b, c] => line(format_args!("f {} {} {}\n", a + 1, b + 1, c + 1)),
            [a, b] => line(format_args!("l {} {}\n", a + 1, b + 1)),
            _ => {}
        }
    }
    out.into_bytes()
}
