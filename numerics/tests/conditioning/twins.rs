//! Two points 1e-9 apart: smooth kernels cannot tell them apart in float64, kernels with a kink can.
//!
//! Near 0 such a kernel is `1 − c r^s`. With `δ = 1e-9` the diagonal entry of the second point keeps
//! `2c δ^s`: 1e-9 for a kink (s = 1), but 1e-18, below rounding, for all others (s = 2).

use gramian_numerics::error::{NotDefinite, NumericsError};
use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::regression::solver::Method;
use gramian_numerics::regression::sums::jets::JetOrder;

use crate::support::*;

const N: usize = 150;
const TWINS: [usize; 2] = [70, N];

/// The sphere alone, and the sphere with a second point 1e-9 from point 70, along the surface.
fn clouds() -> (Cloud, Cloud) {
    let alone = fibonacci_sphere(N);
    let mut points = rows::<3>(&alone);
    let [x, y, z] = points[TWINS[0]];
    let r = x.hypot(y);
    points.push([x - 1e-9 * y / r, y + 1e-9 * x / r, z]);
    (alone, cloud(&points))
}

fn length_scale(family: Family) -> f64 {
    if matches!(family, Family::Wendland { .. }) { 2.0 } else { 0.7 }
}

fn has_kink(family: Family) -> bool {
    kernel(family, 1.0).has_kink()
}

#[test]
fn values_of_a_smooth_function_give_the_answer_of_one_point() {
    let (alone, twins) = clouds();
    let queries = around_sphere(20, 4);
    for family in FAMILIES {
        let kernel = kernel(family, length_scale(family));
        let expected = jets(&fit(&factorize(&alone, kernel.clone(), 0.0), &vec![1.0; N]), &queries);
        let factor = factorize(&twins, kernel, 0.0);
        assert_eq!(factor.method() == Method::Cholesky, has_kink(family), "{family:?}");
        let u = fit(&factor, &vec![1.0; N + 1]);
        let found = jets(&u, &queries);
        // u of one point is 1 to 1e-9 |∇u| at the other. Elsewhere this moves u by the same, times the
        // cardinal function of the twin, which is at most 1 for a kink. Derivatives scale with the distance
        // of the queries, at least 0.01.
        let change: Vec<f64> =
            (0..3).map(|order| relative_distance(&found[order], &expected[order])).collect();
        assert!(change[0] < 1e-8 && change[1] < 1e-7 && change[2] < 1e-5, "{family:?}: {change:?}");
    }
}

#[test]
fn values_that_differ_are_met_by_a_kink_and_refused_by_smooth_kernels() {
    let (_, twins) = clouds();
    for family in FAMILIES {
        let factor = factorize(&twins, kernel(family, length_scale(family)), 0.0);
        for difference in [1.0, 1e-3, 1e-6] {
            let mut values = vec![1.0; N + 1];
            values[N] += difference;
            let what = format!("{family:?}, values {difference:e} apart");
            match try_fit(&factor, &values) {
                Ok(u) => {
                    assert!(has_kink(family), "{what}: a slope of {:e}", difference / 1e-9);
                    // Weights are difference/δ, and this is their rounding.
                    let rounding = 100.0 * EPS * (1.0 + difference * 1e9);
                    assert!(distance(&at_points(&u), &values) < rounding, "{what}");
                }
                Err(error) => {
                    assert!(!has_kink(family), "{what}: {error}");
                    check_refusal(&twins, factor.kernel().clone(), &values, &error);
                }
            }
        }
    }
}

/// Checks that the residual is the reason, and that `minimum_alpha` is a remedy: with it, u at two points
/// whose values disagree is the mean of these values.
fn check_refusal(twins: &Cloud, kernel: Kernel, values: &[f64], error: &NumericsError) {
    use NotDefinite::{BackwardError, Residual};
    let NumericsError::NotPositiveDefinite { reason: Residual { .. } | BackwardError { .. }, minimum_alpha } =
        *error
    else {
        panic!("{error}");
    };
    let u = at_points(&fit(&factorize(twins, kernel, minimum_alpha), values));
    let [first, second] = TWINS.map(|point| u[point]);
    let (mean, difference) = (0.5 * (values[TWINS[0]] + values[N]), values[N] - 1.0);
    assert!((first - second).abs() < 1e-3 * difference, "{first} and {second}");
    assert!((first - mean).abs() < 1e-3 * difference, "{first} instead of {mean}");
}

fn at_points(u: &Interpolant) -> Vec<f64> {
    u.at(u.solver.cloud(), JetOrder::Value, &Unobserved).unwrap().values()
}

#[test]
fn a_whole_cloud_twice_has_the_rank_of_one() {
    let points = rows::<3>(&fibonacci_sphere(100));
    let mut random = Random(8);
    let moved = points.iter().map(|x| x.map(|c| c + 1e-9 * (2.0 * random.uniform() - 1.0)));
    let twice: Vec<[f64; 3]> = points.iter().copied().chain(moved).collect();
    let kernel = kernel(Family::Matern { order: 2 }, 0.7);
    let factor = factorize(&cloud(&twice), kernel, 0.0);
    assert_eq!((factor.method(), factor.rank()), (Method::PivotedCholesky, 100));
    // The twins lie 1e-9 off the surface u = 1 of the others. No function of the kernel meets
    // both layers, since that would need a gradient of zero at 100 points. So the fit is refused,
    // or it is 1 to 1e-8 on both.
    match try_fit(&factor, &vec![1.0; 200]) {
        Ok(u) => assert!(u.solution.misfit < 1e-7),
        Err(error) => assert!(matches!(error, NumericsError::NotPositiveDefinite { .. }), "{error}"),
    }
}
