//! Noise variances that differ from point to point, some of them zero.

use std::sync::Arc;

use gramian_numerics::kernel::Family;
use gramian_numerics::observer::Unobserved;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::regression::solver::{Method, Solver, System};
use gramian_numerics::regression::sums::regularization::Regularization;

use crate::support::*;

/// Fits a wave at 512 points, every third with noise. The others are exact, and more than
/// the kernel can tell apart.
fn mixed(variance: f64) -> Interpolant {
    let points = fibonacci_sphere(512);
    let variances = (0..512).map(|i: usize| if i.is_multiple_of(3) { variance } else { 0.0 }).collect();
    let noise = Regularization::per_point(variances).unwrap();
    let factor = System::new(Arc::new(points.clone()), kernel(Family::Gauss, 1.0), noise)
        .and_then(|system| Solver::dense(system, &Unobserved));
    let factor = Arc::new(factor.unwrap());
    assert_eq!(factor.method(), Method::PivotedCholesky);
    // Only the noisy points deviate from the wave, by less than their standard deviation.
    let error = |i: usize| if i.is_multiple_of(3) { variance.sqrt() * (1.7 * i as f64).sin() } else { 0.0 };
    let values: Vec<f64> = points.points().enumerate().map(|(i, x)| wave(x) + error(i)).collect();
    Interpolant::fit(factor, &values, &Unobserved).unwrap()
}

#[test]
fn exact_points_are_met_and_noisy_ones_smoothed() {
    // Queries lie on the sphere: off it even exact values determine u only as far as its norm does.
    let queries = random_sphere(40, &mut Random(3));
    let expected = waves(&queries);
    for variance in [1e-10, 1e-4, 1.0, 1e6] {
        let u = mixed(variance);
        // 341 exact points determine the wave to 1e-7 of its size, as they would alone. The
        // noisy ones change nothing.
        let error = relative_distance(&jets(&u, &queries)[0], &expected);
        println!("variance {variance:e}: error {error:.1e}, residual {:.1e}", u.solution.relative_residual);
        assert!(error < 1e-6, "variance {variance:e}: {error:e}");
        assert!(u.solution.relative_residual < 1e-9);
        // The exact points are met as closely, whatever the noise of the others.
        let misfit = jets(&u, u.solver.cloud())[0].clone();
        let exact: Vec<f64> = (0..512).filter(|i: &usize| !i.is_multiple_of(3)).map(|i| misfit[i]).collect();
        let wanted: Vec<f64> = (0..512)
            .filter(|i: &usize| !i.is_multiple_of(3))
            .map(|i| wave(u.solver.cloud().point(i)))
            .collect();
        assert!(relative_distance(&exact, &wanted) < 1e-6);
    }
}
