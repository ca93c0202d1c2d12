//! Arithmetic of small vectors, given as slices.

use super::small::Small;

#[inline]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Returns `√Σv²`. If the squares leave the range of float64, the components are scaled first.
#[inline]
pub(crate) fn norm(v: &[f64]) -> f64 {
    let squared = dot(v, v);
    if (f64::MIN_POSITIVE / f64::EPSILON..f64::INFINITY).contains(&squared) {
        return squared.sqrt();
    }
    let largest = v.iter().fold(0.0, |a: f64, c| a.max(c.abs()));
    if largest == 0.0 || largest.is_infinite() {
        return squared.sqrt();
    }
    largest * v.iter().map(|c| (c / largest).powi(2)).sum::<f64>().sqrt()
}

/// Returns the vector of length 1 in the same direction, or zero for zero.
///
/// Components are scaled first, so that none is lost to the range of float64.
pub(crate) fn unit(v: &[f64]) -> Small {
    let largest = v.iter().fold(0.0, |a: f64, c| a.max(c.abs()));
    if largest == 0.0 {
        return Small::from_slice(v);
    }
    let scaled: Small = v.iter().map(|c| c / largest).collect();
    let length = norm(&scaled);
    scaled.iter().map(|c| c / length).collect()
}

/// Returns an orthonormal basis of the complement of the unit vector ν, as rows `[d−1, d]`.
///
/// The rows are the other columns of the Householder reflection that maps ν to ±e₁.
pub(crate) fn tangent_basis(normal: &[f64]) -> Small {
    let d = normal.len();
    let sign = if normal[0] < 0.0 { -1.0 } else { 1.0 };
    let mut w = Small::from_slice(normal);
    w[0] += sign;
    // For a unit ν, |w|² = 2(1 + |ν₁|): the choice of sign avoids cancellation.
    let factor = 1.0 / (1.0 + normal[0].abs());
    let entry = |axis: usize, i: usize| f64::from(u8::from(i == axis)) - factor * w[i] * w[axis];
    (1..d).flat_map(|axis| (0..d).map(move |i| (axis, i))).map(|(axis, i)| entry(axis, i)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_vectors_have_length_one_at_any_size() {
        for size in [1e-250, 1e-3, 1.0, 1e100] {
            let found = unit(&[3.0 * size, 0.0, -4.0 * size]);
            assert!((found[0] - 0.6).abs() < 1e-15 && (found[2] + 0.8).abs() < 1e-15, "{size}: {found:?}");
        }
        // The normals of merged points may cancel.
        assert_eq!(unit(&[0.0, 0.0])[..], [0.0, 0.0]);
    }

    #[test]
    fn lengths_are_right_where_their_squares_are_out_of_range() {
        for size in [1e-300, 1e-160, 1e-3, 1e160, 1e300] {
            assert!((norm(&[3.0 * size, 0.0, -4.0 * size]) / (5.0 * size) - 1.0).abs() < 1e-15, "{size}");
        }
        assert_eq!(norm(&[0.0, 0.0]), 0.0);
        assert_eq!(norm(&[1.0, f64::INFINITY]), f64::INFINITY);
        assert!(norm(&[1e200, f64::NAN]).is_nan() && norm(&[0.0, f64::NAN]).is_nan());
    }

    #[test]
    fn tangent_bases_are_orthonormal_for_every_normal() {
        for normal in [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.6, -0.8], [-0.48, 0.6, 0.64]] {
            let basis = tangent_basis(&normal);
            for (i, a) in basis.chunks(3).enumerate() {
                assert!(dot(a, &normal).abs() < 1e-15);
                for (j, b) in basis.chunks(3).enumerate() {
                    assert!((dot(a, b) - f64::from(u8::from(i == j))).abs() < 1e-15);
                }
            }
        }
    }
}
