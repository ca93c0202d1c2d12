//! Small vectors as slices.

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(crate) fn norm(v: &[f64]) -> f64 {
    dot(v, v).sqrt()
}

/// An orthonormal basis of ν's complement: the other columns of the Householder reflection that maps ν to ±e₁.
pub(crate) fn tangent_basis(normal: &[f64]) -> Vec<Vec<f64>> {
    let d = normal.len();
    let sign = if normal[0] < 0.0 { -1.0 } else { 1.0 };
    let mut w = normal.to_vec();
    w[0] += sign;
    // |w|² = 2(1 + |ν₁|) for a unit ν: no cancellation by the choice of sign.
    let factor = 1.0 / (1.0 + normal[0].abs());
    (1..d)
        .map(|axis| (0..d).map(|i| f64::from(u8::from(i == axis)) - factor * w[i] * w[axis]).collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangent_bases_are_orthonormal_for_every_normal() {
        for normal in [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.6, -0.8], [-0.48, 0.6, 0.64]] {
            let basis = tangent_basis(&normal);
            for (i, a) in basis.iter().enumerate() {
                assert!(dot(a, &normal).abs() < 1e-15);
                for (j, b) in basis.iter().enumerate() {
                    assert!((dot(a, b) - f64::from(u8::from(i == j))).abs() < 1e-15);
                }
            }
        }
    }
}
