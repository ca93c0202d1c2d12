//! Estimate of the 1-norm of a linear map that is known only by its action.

use faer::{Mat, MatMut};

/// Returns a lower bound of `‖W‖₁` for an `[n, n]` map, and `W·1`, the first image that it computes.
/// The bound is nearly always within a factor 3.
///
/// The method is one step of Hager's algorithm with Higham's safeguard (Higham 2002, "Accuracy and Stability
/// of Numerical Algorithms", algorithm 15.1). The gradient of `‖Wx‖₁` at the mean of all columns points to a
/// large column. More steps seldom find a column that is twice as large, and each costs two more
/// applications. A bound that is not finite means that the map overflows.
///
/// # Errors
/// Returns the errors of the map.
pub(crate) fn estimate_norm1<E>(
    n: usize,
    apply: impl Fn(MatMut<'_, f64>) -> Result<(), E>,
    apply_transposed: impl Fn(MatMut<'_, f64>) -> Result<(), E>,
) -> Result<(f64, Vec<f64>), E> {
    let norm_of_image = |mut x: Mat<f64>| -> Result<(f64, Mat<f64>), E> {
        apply(x.as_mut())?;
        let norm1: f64 = (0..n).map(|i| x[(i, 0)].abs()).sum();
        Ok((norm1, x))
    };
    let (of_ones, image) = norm_of_image(Mat::from_fn(n, 1, |_, _| 1.0))?;
    let mut gradient = Mat::from_fn(n, 1, |i, _| if image[(i, 0)] < 0.0 { -1.0 } else { 1.0 });
    apply_transposed(gradient.as_mut())?;
    let slope = |i: usize| gradient[(i, 0)].abs();
    let steepest = (0..n).max_by(|&a, &b| slope(a).total_cmp(&slope(b))).unwrap_or(0);
    let (of_column, _) = norm_of_image(Mat::from_fn(n, 1, |i, _| if i == steepest { 1.0 } else { 0.0 }))?;
    // The safeguard: a vector of alternating signs, for matrices on which the gradient is blind.
    let ramp = |i: usize| 1.0 + i as f64 / (n.max(2) - 1) as f64;
    let (of_ramp, _) = norm_of_image(Mat::from_fn(n, 1, |i, _| if i % 2 == 0 { ramp(i) } else { -ramp(i) }))?;
    let found = [of_ones / n as f64, of_column, 2.0 * of_ramp / (3.0 * n as f64)];
    let largest = |most: f64, norm: f64| if norm.is_finite() { most.max(norm) } else { f64::INFINITY };
    Ok((found.into_iter().fold(0.0, largest), (0..n).map(|i| image[(i, 0)]).collect()))
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    fn estimate(w: &Mat<f64>) -> f64 {
        let apply = |mut x: MatMut<'_, f64>| {
            let y = w * x.as_ref();
            x.copy_from(&y);
            Ok::<(), Infallible>(())
        };
        let apply_transposed = |mut x: MatMut<'_, f64>| {
            let y = w.transpose() * x.as_ref();
            x.copy_from(&y);
            Ok::<(), Infallible>(())
        };
        let Ok((norm, _)) = estimate_norm1(w.nrows(), apply, apply_transposed);
        norm
    }

    #[test]
    fn the_estimate_is_a_lower_bound_within_a_factor_three() {
        for seed in 0..20 {
            let n = 30;
            let entry = |i: usize, j: usize| (1.7 * (seed * 900 + i * 30 + j) as f64).sin();
            let w = Mat::from_fn(n, n, |i, j| entry(i, j) * 10f64.powi(-(((i + j) % 7) as i32)));
            let exact = (0..n).map(|j| (0..n).map(|i| w[(i, j)].abs()).sum::<f64>()).fold(0.0, f64::max);
            let found = estimate(&w);
            assert!(found <= exact * (1.0 + 1e-14) && found >= exact / 3.0, "{found} of {exact}");
        }
    }

    #[test]
    fn the_estimate_of_a_number_is_its_absolute_value() {
        assert_eq!(estimate(&Mat::from_fn(1, 1, |_, _| -4.0)), 4.0);
    }
}
