//! Continuity in α: as α grows from 0 to 1e-6 the answer changes smoothly, even where the method switches.

use std::f64::consts::PI;

use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::solver::Method;

use crate::support::*;

/// The α of a walk: 0, then 60 values from 1e-20 to 1e-6. Four a decade put several on
/// both sides of every switch.
fn alphas() -> impl Iterator<Item = f64> {
    std::iter::once(0.0).chain((0..60).map(|k| 10f64.powf(-20.0 + 14.0 * f64::from(k) / 59.0)))
}

/// A fit that is followed as α grows: each answer is compared with the previous one.
///
/// In exact arithmetic a step from α₁ to α₂ changes u at the points by at most `α₂|Λ|`, the misfit of α₂. In
/// the eigenvectors of K the change is `(α₂/(λ+α₂) − α₁/(λ+α₁)) y`. Each component lies between 0 and that of
/// the misfit, `α₂/(λ+α₂) y`. Queries lie among the points and each answer is measured against its own size,
/// so the bound serves u, ∇u and Δu.
///
/// Added to it is the scatter that rounding leaves at α = 0: `floor` in u, `floor`/h in ∇u and `floor`/h²
/// in Δu. The powers of h arise because scatter changes from point to point, and the points are h ≥ 0.1
/// apart. A cliff would be larger.
struct Walk {
    points: Cloud,
    kernel: Kernel,
    values: Vec<f64>,
    queries: Cloud,
    floor: f64,
}

impl Walk {
    fn check(&self) {
        let mut last: Option<[Vec<f64>; 3]> = None;
        let mut methods = Vec::new();
        let mut scatter = [0.0f64; 3];
        for alpha in alphas() {
            let factor = factorize(&self.points, self.kernel.clone(), alpha);
            let u = fit(&factor, &self.values);
            let weights = u.solution.weights.iter().map(|w| w * w).sum::<f64>().sqrt();
            let misfit = alpha * weights / largest(&self.values);
            let found = jets(&u, &self.queries);
            for (order, last) in last.iter().flatten().enumerate() {
                let step = relative_distance(last, &found[order]);
                scatter[order] = scatter[order].max(step - misfit);
                let allowed = self.floor * 10f64.powi(order as i32) + misfit;
                let at = format!("derivative {order}, α = {alpha:e} ({:?})", factor.method());
                assert!(step <= allowed, "{:?}, {at}: {step:e} of {allowed:e}", self.kernel.family());
            }
            methods.push(factor.method());
            last = Some(found);
        }
        let n_pivoted = methods.iter().filter(|&&method| method == Method::PivotedCholesky).count();
        println!("{:?}: {n_pivoted} pivoted, scatter {scatter:?}", self.kernel.family());
        // Exactly one switch, and both methods take part. Otherwise the test would show nothing.
        assert!(methods.is_sorted_by_key(|&method| method == Method::Cholesky), "{methods:?}");
        assert!(n_pivoted > 5 && n_pivoted < methods.len() - 5, "{n_pivoted}");
    }
}

#[test]
fn a_function_that_the_kernel_can_just_follow() {
    let points = fibonacci_sphere(512);
    Walk {
        values: points.points().map(|x| (PI * (1.0 + 2.0 * x[2])).sin()).collect(),
        points,
        kernel: kernel(Family::Gauss, 1.0),
        queries: random_sphere(24, &mut Random(1)),
        floor: 5e-6,
    }
    .check();
}

#[test]
fn analytic_kernels_on_a_sphere() {
    for (family, length_scale) in
        [(Family::Gauss, 2.0), (Family::InverseMultiquadric, 3.0), (Family::Laplace { epsilon: 1.0 }, 4.0)]
    {
        let points = fibonacci_sphere(400);
        let kernel = kernel(family, length_scale);
        let (values, queries) = (waves(&points), random_sphere(20, &mut Random(2)));
        Walk { points, kernel, values, queries, floor: 1e-6 }.check();
    }
}

#[test]
fn a_filled_cube() {
    let mut random = Random(3);
    let points = random_cube(400, 3, &mut random);
    // Corners are left out: no point may be near, and extrapolation multiplies every rounding by hundreds.
    let queries = stretched(&random_cube(20, 3, &mut random), &[0.8; 3]);
    let (values, kernel) = (waves(&points), kernel(Family::Gauss, 2.5));
    Walk { points, kernel, values, queries, floor: 1e-5 }.check();
}

#[test]
fn rough_kernels_where_two_points_nearly_coincide() {
    for (family, length_scale) in [
        (Family::Matern { order: 1 }, 0.7),
        (Family::Matern { order: 2 }, 0.7),
        (Family::Matern { order: 4 }, 0.7),
    ] {
        let mut points = rows::<3>(&fibonacci_sphere(200));
        let [x, y, z] = points[20];
        points.push([x - 1e-9 * y, y + 1e-9 * x, z]);
        let points = cloud(&points);
        let kernel = kernel(family, length_scale);
        let (values, queries) = (vec![1.0; 201], random_sphere(20, &mut Random(4)));
        Walk { points, kernel, values, queries, floor: 1e-9 }.check();
    }
}
