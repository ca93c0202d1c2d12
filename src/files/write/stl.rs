//! STL, binary: triangles with the normals of their planes, for printers and CAD. It has no place for
//! numbers.

use super::table::Table;

const HEADER_BYTES: usize = 80;

/// Writes the triangles of a mesh, counter-clockwise seen from outside.
///
/// # Errors
/// Refuses curves in the plane.
pub fn write(table: &Table) -> Result<Vec<u8>, String> {
    if table.dimension != 3 {
        return Err(
            "a curve in the plane has no triangles, which are all that .stl holds: take .ply or .vtp"
                .to_owned(),
        );
    }
    let mut out = b"gramian: unit of lengths is that of the points".to_vec();
    out.resize(HEADER_BYTES, b' ');
    let triangles = table.cells.chunks_exact(3);
    out.extend((triangles.len() as u32).to_le_bytes());
    for cell in triangles {
        let corners = [0, 1, 2].map(|at| corner(table, cell[at] as usize));
        let rows = [normal_of(corners), corners[0], corners[1], corners[2]];
        rows.as_flattened().iter().for_each(|x| out.extend((*x as f32).to_le_bytes()));
        out.extend(0u16.to_le_bytes());
    }
    Ok(out)
}

fn corner(table: &Table, vertex: usize) -> [f64; 3] {
    [0, 1, 2].map(|axis| table.positions[3 * vertex + axis])
}

/// The unit normal of a triangle, or zeros for one without area.
fn normal_of([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let [u, v] = [b, c].map(|end| [0, 1, 2].map(|axis| end[axis] - a[axis]));
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = cross.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 { cross.map(|x| x / length) } else { [0.0; 3] }
}
