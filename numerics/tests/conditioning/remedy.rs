//! The remedy `minimum_alpha`: with it Cholesky succeeds, and answers that need its factor are given.

use gramian_numerics::error::{NotDefinite, NumericsError};
use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::function::posterior::{log_marginal_likelihood, variances};
use gramian_numerics::regression::solver::Method;

use crate::support::*;

/// Fits without α, takes the α that the refusal of variances names, and checks that it suffices.
fn check_remedy(points: &Cloud, kernel: Kernel, what: &str) {
    let factor = factorize(points, kernel.clone(), 0.0);
    assert_eq!(factor.method(), Method::PivotedCholesky, "{what}");
    let refusal = variances(&factor, points, &Unobserved).unwrap_err();
    let NumericsError::NotPositiveDefinite { reason: NotDefinite::NeedsCholesky { point }, minimum_alpha } =
        refusal
    else {
        panic!("{what}: {refusal}");
    };
    assert!(point < points.n_points(), "{what}: point {point}");
    // The named α is 4 n ε ‖K‖₁, which is at most 4 n² ε k₀.
    let n = points.n_points() as f64;
    assert!(minimum_alpha > 0.0 && minimum_alpha <= 4.01 * n * n * EPS * kernel.at_zero(), "{what}");
    let remedied = factorize(points, kernel.clone(), minimum_alpha);
    assert_eq!(remedied.method(), Method::Cholesky, "{what}");
    let latent = variances(&remedied, points, &Unobserved).unwrap().latent;
    // The variance at a point known to within α is at most α, plus the rounding of k₀.
    assert!(largest(&latent) <= minimum_alpha + 4.0 * n * EPS * kernel.at_zero(), "{what}");
    let values = vec![1.0; points.n_points()];
    let u = fit(&remedied, &values);
    assert!(log_marginal_likelihood(&remedied, &u.solution, 1.0).unwrap().is_finite(), "{what}");
}

#[test]
fn where_all_points_are_one_to_the_kernel() {
    for n in [2, 3, 4, 10, 100, 400] {
        for variance in [1e-6, 1.0, 1e6] {
            let kernel = Kernel::new(Family::Gauss, 1e9, variance).unwrap();
            check_remedy(&fibonacci_sphere(n), kernel, &format!("{n} points, variance {variance}"));
        }
    }
}

#[test]
fn where_two_points_are_one_to_the_kernel() {
    for n in [2, 3, 4, 10, 100, 400] {
        for length_scale in [0.01, 0.5] {
            let mut points = rows::<3>(&fibonacci_sphere(n - 1));
            points.push(points[0].map(|x| x + 1e-10));
            let kernel = kernel(Family::Matern { order: 2 }, length_scale);
            check_remedy(&cloud(&points), kernel, &format!("{n} points, ℓ = {length_scale}"));
        }
    }
}
