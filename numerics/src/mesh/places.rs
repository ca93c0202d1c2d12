//! Arithmetic of places in space.

use crate::machine::vector::norm;

/// Returns a − b. Both are `[3]`.
pub(super) fn sub(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Returns the size of a cell, given by its vertices `[d][d]`: the length of a segment or the area of a
/// triangle.
pub(super) fn size(vertices: &[&[f64]]) -> f64 {
    match *vertices {
        [&[a, b], &[c, d]] => norm(&[a - c, b - d]),
        [&[a, b, c], &[d, e, f], &[g, h, i]] => {
            let apex = [a, b, c];
            0.5 * norm(&cross(sub(&[d, e, f], &apex), sub(&[g, h, i], &apex)))
        }
        _ => 0.0,
    }
}
