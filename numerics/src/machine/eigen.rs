//! Eigenvalues and eigenvectors of small symmetric matrices, such as shape operators.

use smallvec::SmallVec;

use super::small::{Small, zeros};

/// Limit on the sweeps: by then Jacobi has converged to rounding for any matrix of the sizes met here.
const MAX_SWEEPS: usize = 30;

/// Returns the eigenvalues in ascending order, and orthonormal eigenvectors as rows, `[k, k]`.
///
/// Row i of the eigenvectors belongs to `values[i]`. The matrix is row-major `[k, k]`, and only its upper
/// triangle is read. Cyclic Jacobi rotations (Golub and Van Loan 2013, sec. 8.5) are accurate to rounding
/// relative to the norm of the matrix.
pub(crate) fn symmetric_eigen(matrix: &[f64], k: usize) -> (Small, Small) {
    let mut a = Small::from_slice(matrix);
    let mut v = zeros(k * k);
    (0..k).for_each(|i| v[i * k + i] = 1.0);
    for _ in 0..MAX_SWEEPS {
        let mut rotated = false;
        for p in 0..k {
            for q in p + 1..k {
                rotated |= rotate(&mut a, &mut v, k, p, q);
            }
        }
        if !rotated {
            break;
        }
    }
    let mut order: SmallVec<[usize; 16]> = (0..k).collect();
    order.sort_by(|&i, &j| a[i * k + i].total_cmp(&a[j * k + j]));
    let values = order.iter().map(|&i| a[i * k + i]).collect();
    (values, order.iter().flat_map(|&i| &v[i * k..][..k]).copied().collect())
}

/// Rotates the axes p and q so that `a[p][q]` becomes 0. Returns false, without rotating, if that entry is
/// mere rounding.
fn rotate(a: &mut [f64], v: &mut [f64], k: usize, p: usize, q: usize) -> bool {
    let (app, aqq, apq) = (a[p * k + p], a[q * k + q], a[p * k + q]);
    if apq.abs() <= 0.25 * f64::EPSILON * app.abs().sqrt() * aqq.abs().sqrt() || apq == 0.0 {
        return false;
    }
    let theta = (aqq - app) / (2.0 * apq);
    // If θ² overflows, t and with it the angle are 0.
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    a[p * k + p] = app - t * apq;
    a[q * k + q] = aqq + t * apq;
    a[p * k + q] = 0.0;
    for i in (0..k).filter(|&i| i != p && i != q) {
        let (at_p, at_q) = (index(k, i, p), index(k, i, q));
        let (x, y) = (a[at_p], a[at_q]);
        a[at_p] = c * x - s * y;
        a[at_q] = s * x + c * y;
    }
    let (before, from_q) = v.split_at_mut(q * k);
    for (x, y) in before[p * k..][..k].iter_mut().zip(&mut from_q[..k]) {
        (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
    }
    true
}

/// Index of the entry (i, j) in the upper triangle of a row-major matrix `[k, k]`.
fn index(k: usize, i: usize, j: usize) -> usize {
    i.min(j) * k + i.max(j)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn eigenpairs_reproduce_the_matrix(k in 1usize..7, entries in prop::collection::vec(-3.0f64..3.0, 36)) {
            let entry = |i: usize, j: usize| entries[i.min(j) * 6 + i.max(j)];
            let matrix: Vec<f64> = (0..k * k).map(|at| entry(at / k, at % k)).collect();
            let (values, vectors) = symmetric_eigen(&matrix, k);
            prop_assert!(values.windows(2).all(|w| w[0] <= w[1]));
            for (value, vector) in values.iter().zip(vectors.chunks(k)) {
                for i in 0..k {
                    let image: f64 = (0..k).map(|j| matrix[i * k + j] * vector[j]).sum();
                    // The error is a small multiple of ε times the norm, which is at most 18 here.
                    prop_assert!((image - value * vector[i]).abs() < 1e-13);
                }
            }
            for (a, x) in vectors.chunks(k).enumerate() {
                for (b, y) in vectors.chunks(k).enumerate() {
                    let dot: f64 = x.iter().zip(y).map(|(x, y)| x * y).sum();
                    prop_assert!((dot - f64::from(u8::from(a == b))).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn sizes_whose_squares_are_out_of_range_change_nothing() {
        // The eigenvalues are √3 and −√3 times the size.
        for size in [1e-200, 1e200] {
            let (values, _) = symmetric_eigen(&[size, std::f64::consts::SQRT_2 * size, 0.0, -size], 2);
            assert!((values[0] / size + 3f64.sqrt()).abs() < 1e-15, "{values:?}");
            assert!((values[1] / size - 3f64.sqrt()).abs() < 1e-15, "{values:?}");
        }
    }

    #[test]
    fn equal_eigenvalues_keep_an_orthonormal_basis() {
        let (values, vectors) = symmetric_eigen(&[2.0, 0.0, 0.0, 2.0], 2);
        assert_eq!(values[..], [2.0, 2.0]);
        assert_eq!(vectors[..], [1.0, 0.0, 0.0, 1.0]);
    }
}
